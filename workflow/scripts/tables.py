"""Write the tables of the study, as far as it has what they are of."""

from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.tables import cases
from biogrip_study.tables.layout import write
from biogrip_study.tables.study import coverage, methods, models, verdict_counts

with logged(snakemake):
    study = job_study(snakemake)
    given = {name: paths(files) for name, files in snakemake.input.items()}
    simulated = study.of(study.simulated)
    covered = study.of(study.covered)
    counted = study.of(study.counted)

    def of(study, name):
        return [file for file in given[name] if file.stem in study.cases]

    tables = {
        "errors": lambda: cases.errors(study, given["identifications"]),
        "methods": lambda: methods(simulated, of(simulated, "identifications")),
        "coverage": lambda: coverage(
            covered, of(covered, "targets"), given["intervals"], of(covered, "calibrated")
        ),
        "verdict_counts": lambda: verdict_counts(
            counted, [file for file in given["intervals"] if file.parent.name in counted.cases]
        ),
        "models": lambda: models(study, given["fits"]),
    }
    for file in paths(snakemake.output.tables):
        write(tables[file.stem](), file)
