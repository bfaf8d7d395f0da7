"""Compare the linear with the nonlinear model over angles and torques."""

from pathlib import Path

from biogrip.stages.job import job_study, logged
from biogrip.stages.model_difference import compare

with logged(snakemake):
    study = job_study(snakemake)
    compare(study.of(study.gripped), Path(snakemake.output.differences))
