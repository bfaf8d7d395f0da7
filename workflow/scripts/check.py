"""Compare regenerated tables with the published ones."""

from pathlib import Path

from biogrip.stages.job import logged, paths
from biogrip.tables.layout import compare

with logged(snakemake):
    print(compare(Path(snakemake.params.published), paths(snakemake.input.made)))
