"""Draw the figures of a case, and write its summary."""

from pathlib import Path

from biogrip.figures.style import save, styled
from biogrip_study.figures import case_fit, case_likelihood, course
from biogrip_study.page.page import write_summary
from biogrip_study.stages.job import arguments, job_case, logged, paths

DRAWINGS = {
    "convergence": course.draw_convergence,
    "evolution": course.draw_evolution,
    "waterfall": course.draw_waterfall,
    "fit": case_fit.draw_fits,
    "judged_fit": case_fit.draw_judged_fit,
    "profiles": case_likelihood.draw_profiles,
    "force": case_fit.draw_force,
    "scatter": course.draw_scatter,
}

with logged(snakemake):
    case = job_case(snakemake)
    *figures, summary = paths(snakemake.output)
    drawn = {}
    for name, draw in DRAWINGS.items():
        if files := [file for file in figures if file.stem == f"{name}_{case.name}"]:
            with styled():
                save(draw(**arguments(snakemake, draw)), *files)
            drawn[name] = files[0]
    shown = [drawn[name] for name in ("judged_fit", "profiles") if name in drawn]
    write_summary(case, Path(snakemake.input.verdicts), shown, summary)
