"""Identify samples whose jaws would have to pull, with and without contact."""

from pathlib import Path

from biogrip.stages.job import job_study, logged
from biogrip.tables.contact_loss import contact_loss, linear_cases
from biogrip.tables.layout import write

with logged(snakemake):
    study = job_study(snakemake)
    write(contact_loss(study.of(linear_cases(study))), Path(snakemake.output[0]))
