"""Count the verdicts on simulated traces."""

from pathlib import Path

from biogrip.stages.job import logged
from biogrip.stages.levels import summarise

with logged(snakemake):
    output = snakemake.output
    summarise(list(map(Path, snakemake.input)), Path(output.table), Path(output.page))
