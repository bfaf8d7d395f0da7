"""Identify a case by the genetic algorithm under every reading of the paper."""

from biogrip.stages.job import logged, run
from biogrip.stages.sweeps import identify_readings

with logged(snakemake):
    run(snakemake, identify_readings)
