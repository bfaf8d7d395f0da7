"""Do the stages that the rule names: functions, by their full names."""

from importlib import import_module

from biogrip_study.stages.job import arguments, logged

with logged(snakemake):
    for stage in snakemake.params.stages:
        module, _, name = stage.rpartition(".")
        function = getattr(import_module(module), name)
        function(**arguments(snakemake, function))
