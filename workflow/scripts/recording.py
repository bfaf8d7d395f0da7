"""Read and check a recorded trace."""

from pathlib import Path

from biogrip.stages.job import job_case, logged
from biogrip.stages.targets import record

with logged(snakemake):
    record(
        job_case(snakemake),
        Path(snakemake.input.recorded),
        Path(snakemake.output.measurements),
    )
