"""Fit every sample model to the traces of a batch."""

from pathlib import Path

from biogrip.stages.identification import fit
from biogrip.stages.job import job_case, job_seeds, logged, paths

with logged(snakemake):
    fit(
        job_case(snakemake),
        job_seeds(snakemake),
        Path(snakemake.input.measurements),
        paths(snakemake.input.calibrated),
        Path(snakemake.output.fits),
    )
