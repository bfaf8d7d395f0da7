"""The numerical study of a paper on a MEMS microgripper, run by Snakemake."""
