"""Put together the tables of all batches of recorded traces."""

from pathlib import Path

from biogrip.command.outputs import join_tables
from biogrip.stages.job import logged, paths

with logged(snakemake):
    join_tables(paths(snakemake.input.batches), Path(snakemake.output.table))
