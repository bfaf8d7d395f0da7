"""Judge every claim of the paper."""

from pathlib import Path

from biogrip.stages.job import job_study, logged, paths
from biogrip.tables.claim_rules import read_results
from biogrip.tables.claims import claims
from biogrip.tables.layout import write

with logged(snakemake):
    study, files = job_study(snakemake), snakemake.input
    results = read_results(
        study.of(study.published),
        paths(files.identifications),
        paths(files.histories),
        paths(files.tables),
        paths(files.sweeps),
    )
    write(claims(results), Path(snakemake.output[0]))
