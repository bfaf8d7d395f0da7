"""Judge what is identified at every point of a sweep of a case."""

from pathlib import Path

from biogrip.stages.job import job_study, logged, paths
from biogrip.stages.sweep_points import judge

with logged(snakemake):
    judge(
        job_study(snakemake),
        snakemake.wildcards.sweep,
        snakemake.wildcards.case,
        paths(snakemake.input.identifications),
        paths(snakemake.input.calibrated),
        Path(snakemake.output.points),
    )
