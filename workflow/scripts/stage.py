"""Do the stages that the rule names, functions by their full names; a table is written."""

from pathlib import Path

from biogrip_study.stages.job import called, logged

with logged(snakemake):
    for stage in snakemake.params.stages:
        if table := called(stage, snakemake):
            # Imported here: most stages write their files themselves, and load no pandas.
            from biogrip_study.tables.layout import write

            write(table, Path(snakemake.output.table))
