"""Add noise to a target, a trace a seed."""

from pathlib import Path

from biogrip.stages.job import job_case, job_seeds, logged
from biogrip.stages.targets import measure

with logged(snakemake):
    measure(
        job_case(snakemake),
        job_seeds(snakemake),
        Path(snakemake.input.target),
        Path(snakemake.output.measurements),
    )
