"""Write the study on one page."""

import yaml

from biogrip.page.page import write_report
from biogrip.stages.job import job_study, logged, paths

with logged(snakemake):
    study = job_study(snakemake)
    config = yaml.safe_dump(study.plain, allow_unicode=True)
    files = {name: paths(each) for name, each in snakemake.input.items()}
    write_report(study, config, files, *paths(snakemake.output))
