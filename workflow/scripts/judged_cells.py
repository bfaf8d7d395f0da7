"""Judge simulated traces of an instrument with a number of readings."""

from pathlib import Path

from biogrip.stages.job import logged
from biogrip.stages.levels import judge_cells

with logged(snakemake):
    its = snakemake.wildcards
    output = Path(snakemake.output[0])
    judge_cells(its.instrument, int(its.readings), snakemake.params.traces, output)
