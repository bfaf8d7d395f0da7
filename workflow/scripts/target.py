"""Simulate the noise-free response of a case."""

from pathlib import Path

from biogrip.stages.job import job_case, logged
from biogrip.stages.targets import simulate

with logged(snakemake):
    simulate(job_case(snakemake), Path(snakemake.output.target))
