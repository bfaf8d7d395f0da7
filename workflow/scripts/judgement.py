"""Judge the first trace of a case, and its response without noise if it is simulated."""

from pathlib import Path

from biogrip.stages.job import job_case, logged, paths
from biogrip.stages.judgement import expect, judge

with logged(snakemake):
    case, calibrated = job_case(snakemake), paths(snakemake.input.calibrated)
    judge(case, *paths(snakemake.input.measurements), calibrated, Path(snakemake.output.verdicts))
    for target in paths(snakemake.input.target):
        expect(case, target, calibrated, Path(snakemake.output.expected))
