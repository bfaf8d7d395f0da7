"""Write the study on one page."""

from pathlib import Path

import yaml

from biogrip.page.page import write
from biogrip.stages.job import job_study, logged, paths

with logged(snakemake):
    study = job_study(snakemake)
    write(
        study,
        yaml.safe_dump(study.plain, allow_unicode=True),
        *(paths(files) for _, files in snakemake.input.items()),
        Path(snakemake.output.page),
    )
