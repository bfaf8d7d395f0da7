"""Simulate the noise-free response of a case."""

from biogrip.stages.job import logged, run
from biogrip.stages.targets import simulate

with logged(snakemake):
    run(snakemake, simulate)
