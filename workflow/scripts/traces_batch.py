"""Identify the traces in some rows of a table, as `biogrip identify` does, without JSON files."""

from contextlib import redirect_stdout
from pathlib import Path

from biogrip.command.files import identify_files
from biogrip.command.options import Setting
from biogrip_study.stages.job import logged

with logged(snakemake), Path(snakemake.log[0]).open("a") as log, redirect_stdout(log):
    config = Path(snakemake.input.config) if snakemake.input.config else None
    first, last = map(int, snakemake.wildcards.rows.split("-"))
    # A trace that is not there or cannot be used is a row that says so.
    identify_files(
        [Path(snakemake.input.table)],
        config,
        [Setting("traces.model", ("sample", "model"), snakemake.params.model)],
        table=Path(snakemake.output.found),
        rows=(first, last),
    )
