"""Do the stages that the rule names: functions, by their modules in `biogrip`."""

from importlib import import_module

from biogrip.stages.job import arguments, logged

with logged(snakemake):
    for stage in snakemake.params.stages:
        module, _, name = stage.rpartition(".")
        function = getattr(import_module(f"biogrip.{module}"), name)
        function(**arguments(snakemake, function))
