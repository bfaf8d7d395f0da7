"""Compare the linear model with the nonlinear one, and with one whose jaws cannot pull."""

from pathlib import Path

from biogrip.stages.job import job_study, logged
from biogrip.stages.targets import compare
from biogrip.tables.layout import write
from biogrip.tables.mechanics import contact_loss

with logged(snakemake):
    study = job_study(snakemake)
    compare(study.of(study.gripped), Path(snakemake.output.differences))
    write(contact_loss(study), Path(snakemake.output.contact_loss))
