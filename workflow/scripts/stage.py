"""Do the stages that the rule names: functions, by their modules in `biogrip`."""

from importlib import import_module

from biogrip.stages.job import logged, run

with logged(snakemake):
    for stage in snakemake.params.stages:
        module, _, function = stage.rpartition(".")
        run(snakemake, getattr(import_module(f"biogrip.{module}"), function))
