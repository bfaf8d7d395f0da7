"""Judge the response of a case without noise."""

from pathlib import Path

from biogrip.stages.job import job_case, logged, paths
from biogrip.stages.judgement import expect

with logged(snakemake):
    expect(
        job_case(snakemake),
        Path(snakemake.input.target),
        paths(snakemake.input.calibrated),
        Path(snakemake.output.verdicts),
    )
