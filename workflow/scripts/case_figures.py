"""Draw the figures of a case, and write its summary."""

from pathlib import Path

from biogrip.figures import (
    convergence,
    evolution,
    fit,
    force,
    judged_fit,
    profiles,
    scatter,
    valley,
    waterfall,
)
from biogrip.figures.style import save, styled
from biogrip.page.summary import write
from biogrip.stages.job import job_case, logged, paths

with logged(snakemake):
    case, files = job_case(snakemake), snakemake.input
    found, history, verdicts = map(Path, (files.identifications, files.history, files.verdicts))
    measured, calibrated = paths(files.measurements), paths(files.calibrated)
    target, expected = paths(files.target), paths(files.expected)
    drawings = {
        "convergence": lambda: convergence.draw(case, found, history),
        "evolution": lambda: evolution.draw(case, found, history),
        "fit": lambda: fit.draw(case, found, measured, calibrated),
        "judged_fit": lambda: judged_fit.draw(case, verdicts, measured[0], calibrated),
        "profiles": lambda: profiles.draw(case, verdicts, expected),
        "force": lambda: force.draw(case, *target),
        "scatter": lambda: scatter.draw(case, found, *target, *expected, calibrated),
        "waterfall": lambda: waterfall.draw(case, found),
        "valley": lambda: valley.draw(case, verdicts, found),
    }
    drawn = {}
    for file in map(Path, snakemake.output):
        name = file.stem.removesuffix(f"_{case.name}")
        if file.suffix == ".png":
            with styled():
                save(drawings[name](), file)
            drawn[name] = file
    shown = [drawn[name] for name in ("judged_fit", "profiles", "valley") if name in drawn]
    write(case, verdicts, shown, Path(snakemake.output[-1]))
