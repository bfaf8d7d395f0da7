"""Judge the first trace of a case."""

from pathlib import Path

from biogrip.stages.job import job_case, logged, paths
from biogrip.stages.judgement import judge

with logged(snakemake):
    judge(
        job_case(snakemake),
        *paths(snakemake.input.measurements),
        paths(snakemake.input.calibrated),
        Path(snakemake.output.verdicts),
    )
