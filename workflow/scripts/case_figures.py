"""Draw the figures of a case, and write its summary."""

from pathlib import Path

from biogrip.figures import course, fit, likelihood
from biogrip.figures.style import save, styled
from biogrip.page.page import write_summary
from biogrip.stages.job import job_case, logged, paths

with logged(snakemake):
    case, files = job_case(snakemake), snakemake.input
    found, history, verdicts = map(Path, (files.identifications, files.history, files.verdicts))
    measured, calibrated = paths(files.measurements), paths(files.calibrated)
    target, expected = paths(files.target), paths(files.expected)
    drawings = {
        "convergence": lambda: course.draw_convergence(case, found, history),
        "evolution": lambda: course.draw_evolution(case, found, history),
        "waterfall": lambda: course.draw_waterfall(case, found),
        "fit": lambda: fit.draw_fits(case, found, measured, calibrated),
        "judged_fit": lambda: fit.draw_judged_fit(case, verdicts, measured[0], calibrated),
        "profiles": lambda: likelihood.draw_profiles(case, verdicts, expected),
        "valley": lambda: likelihood.draw_valley(case, verdicts, found),
        "force": lambda: fit.draw_force(case, *target),
        "scatter": lambda: course.draw_scatter(case, found, *target, *expected, calibrated),
    }
    *figures, summary = paths(snakemake.output)
    drawn = {}
    for name, draw in drawings.items():
        if files := [file for file in figures if file.stem == f"{name}_{case.name}"]:
            with styled():
                save(draw(), *files)
            drawn[name] = files[0]
    shown = [drawn[name] for name in ("judged_fit", "profiles", "valley") if name in drawn]
    write_summary(case, verdicts, shown, summary)
