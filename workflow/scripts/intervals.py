"""Estimate and bound the quantities of a case in many traces."""

from pathlib import Path

from biogrip.stages.intervals import estimate
from biogrip.stages.job import job_case, job_seeds, logged, paths

with logged(snakemake):
    estimate(
        job_case(snakemake),
        job_seeds(snakemake),
        Path(snakemake.input.target),
        Path(snakemake.input.expected),
        paths(snakemake.input.calibrated),
        Path(snakemake.output.intervals),
    )
