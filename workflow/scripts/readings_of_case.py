"""Identify a case by the genetic algorithm under every reading of the paper."""

from pathlib import Path

from biogrip.stages.job import job_case, logged
from biogrip.stages.sweeps import identify_readings

with logged(snakemake):
    identify_readings(
        job_case(snakemake), Path(snakemake.input.target), Path(snakemake.output.rows)
    )
