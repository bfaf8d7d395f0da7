"""Draw what the rule names: functions, by their full names, each of one of its outputs."""

from biogrip.figures.style import save, styled
from biogrip_study.stages.job import called, logged, paths

with logged(snakemake), styled():
    for stage, (_, files) in zip(snakemake.params.stages, snakemake.output.items(), strict=True):
        save(called(stage, snakemake), *paths(files))
