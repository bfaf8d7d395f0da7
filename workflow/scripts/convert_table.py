"""Write a table as Markdown or LaTeX."""

from pathlib import Path

from biogrip.stages.job import logged
from biogrip.tables.layout import convert

with logged(snakemake):
    convert(Path(snakemake.input[0]), Path(snakemake.output[0]))
