"""Write the study on one page."""

import yaml

from biogrip.page.page import write_report
from biogrip.stages.job import job_study, logged, paths

with logged(snakemake):
    study = job_study(snakemake)
    # But for what changes no result.
    shown = {key: value for key, value in study.plain.items() if key != "pdf"}
    config = yaml.safe_dump(shown, allow_unicode=True)
    files = {name: paths(each) for name, each in snakemake.input.items()}
    write_report(study, config, files, *paths(snakemake.output))
