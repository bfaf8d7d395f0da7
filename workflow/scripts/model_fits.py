"""Fit every sample model to the traces of a batch."""

from biogrip.stages.identification import fit
from biogrip.stages.job import logged, run

with logged(snakemake):
    run(snakemake, fit)
