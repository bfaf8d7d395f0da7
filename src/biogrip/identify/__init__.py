"""Identification of recorded traces from CSV files to verdicts, without Snakemake."""
