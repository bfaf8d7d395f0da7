"""Draw the figures of the study, as far as it has what they show."""

from biogrip.figures.style import save, styled
from biogrip_study.figures import overview
from biogrip_study.figures.overview import draw_answer, shown_cases
from biogrip_study.stages.job import job_study, logged, paths

with logged(snakemake):
    study = job_study(snakemake)
    given = {name: paths(files) for name, files in snakemake.input.items()}
    shown = study.of(shown_cases(study))
    first = next(iter(shown.cases), None)
    answered = given["answered"][0].stem if given["answered"] else None

    def of(name):
        return [file for file in given[name] if file.stem in shown.cases]

    def calibrated_of(case):
        return [file for file in given["calibrated"] if file.stem == case]

    drawings = {
        "answer": lambda: draw_answer(
            study.cases[answered], *given["answered"], calibrated_of(answered)
        ),
        "moduli": lambda: overview.draw_moduli(shown, of("identifications"), of("targets")),
        "overview": lambda: overview.draw_overview(
            shown,
            of("identifications"),
            of("expected"),
            given["measurements"],
            calibrated_of(first),
        ),
    }
    for name, files in snakemake.output.items():
        with styled():
            save(drawings[name](), *paths(files))
