"""Estimate and bound the quantities of a case in many traces."""

from biogrip.stages.intervals import estimate
from biogrip.stages.job import logged, run

with logged(snakemake):
    run(snakemake, estimate)
