"""Identify the traces in some rows of a table, as `biogrip identify --rows` does."""

from contextlib import redirect_stdout
from pathlib import Path

from biogrip.cli import main
from biogrip.stages.job import logged

with logged(snakemake), Path(snakemake.log[0]).open("a") as log, redirect_stdout(log):
    files, made = snakemake.input, snakemake.output
    config = ["--config", files.config] if files.config else []
    options = ["--rows", snakemake.wildcards.rows, "--model", snakemake.params.model, *config]
    status = main(["identify", files.table, *options, "--csv", made.found])
# A trace that is not there or cannot be used is a row that says so.
if not Path(made.found).exists():
    raise SystemExit(status)
