"""Write a table as Markdown or LaTeX."""

from pathlib import Path

from biogrip.files import write_text
from biogrip.stages.job import logged
from biogrip.tables.layout import convert

with logged(snakemake):
    output = Path(snakemake.output[0])
    write_text(output, convert(Path(snakemake.input[0]), output.suffix))
