"""Write the study on one page."""

from pathlib import Path

import yaml

from biogrip.page.page import write
from biogrip.stages.job import job_settings, job_study, logged, paths

with logged(snakemake):
    known = {key: value for key, value in job_settings(snakemake).items() if value is not None}
    write(
        job_study(snakemake),
        yaml.safe_dump(known, allow_unicode=True),
        *(paths(files) for _, files in snakemake.input.items()),
        Path(snakemake.output.page),
    )
