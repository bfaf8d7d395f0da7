"""Judge what is identified at every point of a sweep, write it as a table, and draw it."""

from pathlib import Path

from biogrip.figures.overview import draw_robustness
from biogrip.figures.style import save, styled
from biogrip.stages.job import job_study, logged, paths
from biogrip.tables.layout import write
from biogrip.tables.sweeps import judge, robustness

with logged(snakemake):
    study, sweep = job_study(snakemake), snakemake.wildcards.sweep
    identifications = paths(snakemake.input.identifications)
    points = Path(snakemake.output.points)
    judge(study, sweep, identifications, paths(snakemake.input.calibrated), points)
    write(robustness(study, sweep, points), Path(snakemake.output.table))
    with styled():
        save(draw_robustness(study, sweep, points), *paths(snakemake.output.figure))
