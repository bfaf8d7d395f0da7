"""Identify the sample in every trace of a batch by one method."""

from biogrip.stages.identification import identify
from biogrip.stages.job import logged, run

with logged(snakemake):
    run(snakemake, identify)
