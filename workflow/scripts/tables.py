"""Write the tables of the study, as far as it has what they are of."""

from pathlib import Path

from biogrip.stages.job import job_study, logged, paths
from biogrip.tables import coverage, errors_of_case, evidence, inputs, mechanics, methods
from biogrip.tables import evidence as printed_values
from biogrip.tables import evidence as sampling_evidence
from biogrip.tables import mechanics as contact
from biogrip.tables import mechanics as left_out
from biogrip.tables import mechanics as linearisation
from biogrip.tables import methods as models
from biogrip.tables import methods as timings
from biogrip.tables import verdicts as verdict_counts
from biogrip.tables.layout import write

with logged(snakemake):
    study = job_study(snakemake)
    given = {name: paths(files) for name, files in snakemake.input.items()}
    gripped, simulated = study.of(study.gripped), study.of(study.simulated)
    published, covered = study.of(study.published), study.of(study.covered)
    every = [name for name in study.covered if study.case(name).verdicts_every == 1]
    counted = study.of(every)
    axes = [name for name in study.published if study.cases[name].published.axis_rad]

    def of(study, name):
        return [file for file in given[name] if file.stem in study.cases]

    tables = {
        "errors": lambda: errors_of_case.errors(study, given["errors"]),
        "gene_ranges": lambda: inputs.gene_ranges(study),
        "parameter_ranges": lambda: inputs.parameter_ranges(study),
        "timings": lambda: timings.timings(study, given["times"]),
        "gripper": lambda: inputs.gripper(study),
        "actuator": lambda: inputs.actuator(study),
        "contact": lambda: contact.contacts(study),
        "left_out": lambda: left_out.left_out(study),
        "linearisation": lambda: linearisation.linearisation(gripped, *given["differences"]),
        "mechanics": lambda: mechanics.mechanics(gripped),
        "methods": lambda: methods.methods(simulated, of(simulated, "identifications")),
        "coverage": lambda: coverage.coverage(
            covered, of(covered, "targets"), given["intervals"], of(covered, "calibrated")
        ),
        "verdict_counts": lambda: verdict_counts.verdict_counts(
            counted, [file for file in given["intervals"] if file.parent.name in counted.cases]
        ),
        "models": lambda: models.models(study, given["fits"]),
        "evidence": lambda: evidence.evidence(
            published,
            of(published, "identifications"),
            [file for file in given["measurements"] if file.parent.name in axes],
            of(published, "targets"),
        ),
        "printed_values": lambda: printed_values.printed_values(published),
        "sampling_evidence": lambda: sampling_evidence.sampling_evidence(published),
    }
    for file in map(Path, snakemake.output):
        if file.suffix == ".csv":
            write(tables[file.stem](), file)
