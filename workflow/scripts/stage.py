"""Do the stages that the rule names, functions in modules of `biogrip.stages`."""

from importlib import import_module

from biogrip.stages.job import logged, run

with logged(snakemake):
    for stage in snakemake.params.stages:
        module, _, function = stage.partition(".")
        run(snakemake, getattr(import_module(f"biogrip.stages.{module}"), function))
