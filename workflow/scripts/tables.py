"""Write the tables of the study, as far as it has what they are of."""

from biogrip.stages.job import job_study, logged, paths
from biogrip.tables import cases, coverage, inputs, mechanics, methods
from biogrip.tables.layout import write

with logged(snakemake):
    study = job_study(snakemake)
    given = {name: paths(files) for name, files in snakemake.input.items()}
    gripped, simulated = study.of(study.gripped), study.of(study.simulated)
    covered = study.of(study.covered)
    counted = study.of(study.counted)

    def of(study, name):
        return [file for file in given[name] if file.stem in study.cases]

    tables = {
        "errors": lambda: cases.errors(study, given["identifications"]),
        "gene_ranges": lambda: inputs.gene_ranges(study),
        "parameter_ranges": lambda: inputs.parameter_ranges(study),
        "gripper": lambda: inputs.gripper(study),
        "actuator": lambda: inputs.actuator(study),
        "contact": lambda: mechanics.contacts(study),
        "left_out": lambda: mechanics.left_out(study),
        "linearisation": lambda: mechanics.linearisation(*given["differences"]),
        "mechanics": lambda: mechanics.mechanics(gripped),
        "methods": lambda: methods.methods(simulated, of(simulated, "identifications")),
        "coverage": lambda: coverage.coverage(
            covered, of(covered, "targets"), given["intervals"], of(covered, "calibrated")
        ),
        "verdict_counts": lambda: coverage.verdict_counts(
            counted, [file for file in given["intervals"] if file.parent.name in counted.cases]
        ),
        "models": lambda: methods.models(study, given["fits"]),
    }
    for file in paths(snakemake.output.tables):
        write(tables[file.stem](), file)
