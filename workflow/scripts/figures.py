"""Draw the figures of the study, as far as it has what they show."""

from pathlib import Path

from biogrip.figures import comb, linearisation, linkage, moduli, overview, torque
from biogrip.figures.overview import shown_cases
from biogrip.figures.style import save, styled
from biogrip.stages.job import job_study, logged, paths

with logged(snakemake):
    study = job_study(snakemake)
    given = {name: paths(files) for name, files in snakemake.input.items()}
    gripped, shown = study.of(study.gripped), study.of(shown_cases(study))
    first = next(iter(shown.cases), None)

    def of(name):
        return [file for file in given[name] if file.stem in shown.cases]

    drawings = {
        "comb": lambda: comb.draw(study),
        "linkage": lambda: linkage.draw(gripped),
        "torque": lambda: torque.draw(study),
        "linearisation": lambda: linearisation.draw(gripped, *given["differences"]),
        "moduli": lambda: moduli.draw(shown, of("identifications"), of("targets")),
        "overview": lambda: overview.draw(
            shown,
            of("identifications"),
            of("expected"),
            given["measurements"],
            [file for file in given["calibrated"] if file.stem == first],
        ),
    }
    for file in map(Path, snakemake.output):
        if file.suffix == ".png":
            with styled():
                save(drawings[file.stem](), file)
