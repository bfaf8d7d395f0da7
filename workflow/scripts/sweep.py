"""Write the table of a sweep, and draw it."""

from pathlib import Path

from biogrip.figures.robustness import draw
from biogrip.figures.style import save, styled
from biogrip.stages.job import job_study, logged, paths
from biogrip.tables.heat_maps import heat_maps
from biogrip.tables.layout import write
from biogrip.tables.robustness import robustness

with logged(snakemake):
    maps = heat_maps(job_study(snakemake), snakemake.wildcards.sweep)
    points = paths(snakemake.input.points)
    write(robustness(maps, points), Path(snakemake.output.table[0]))
    with styled():
        save(draw(maps, points), Path(snakemake.output.figure[0]))
