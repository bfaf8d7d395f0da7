"""Read and check a recorded trace."""

from biogrip.stages.job import logged, run
from biogrip.stages.targets import record

with logged(snakemake):
    run(snakemake, record)
