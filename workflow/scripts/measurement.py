"""Add noise to a target, a trace a seed."""

from biogrip.stages.job import logged, run
from biogrip.stages.targets import measure

with logged(snakemake):
    run(snakemake, measure)
