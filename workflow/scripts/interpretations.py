"""Compare the interpretations of the paper."""

from pathlib import Path

from biogrip.stages.job import job_study, logged, paths
from biogrip.tables.layout import write
from biogrip.tables.sweeps import interpretations, interpretations_jointly

with logged(snakemake):
    found = paths(snakemake.input.found)
    study = job_study(snakemake).of(file.stem for file in found)
    write(interpretations(study, found), Path(snakemake.output.apart[0]))
    write(interpretations_jointly(study, found), Path(snakemake.output.jointly[0]))
