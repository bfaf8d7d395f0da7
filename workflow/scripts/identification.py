"""Identify the sample in every trace of a batch by one method."""

from pathlib import Path

from biogrip.stages.identification import identify
from biogrip.stages.job import job_case, job_seeds, logged, paths

with logged(snakemake):
    identify(
        job_case(snakemake),
        snakemake.wildcards.method,
        job_seeds(snakemake),
        Path(snakemake.input.measurements),
        paths(snakemake.input.calibrated),
        *map(Path, snakemake.output),
    )
