"""Fit of the trace that the verdicts of a case are about."""

from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from biogrip.identify.case_problem import CaseProblem
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.fit import draw_fit
from biogrip.products.figures.results import fit_of
from biogrip.products.files.traces import MEASUREMENTS, read_measurements
from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.product import JUDGEMENT, Reads, the
from biogrip.products.stages.calibrated import calibration_of
from biogrip.products.stages.judgement import TRACE
from biogrip.study.study import Case, Study


@dataclass(frozen=True)
class Settings:
    """Title, assumptions and trace of a case's judged fit, and y-limits of the paper's figure."""

    title: str
    problem: CaseProblem
    trace: str
    axis_rad: tuple[float, ...]


def settings(study: Study, case: Case) -> Settings:
    """Return the settings that the fit of the judged trace of a case depends on."""
    trace = "recorded trace" if case.recorded else f"seed {TRACE}"
    return Settings(case.title, case.problem, trace, case.published.axis_rad)


def draw(settings: Settings, verdicts: Path, measurements: Path, calibrated: list[Path]) -> Figure:
    """Draw the judged trace of a case and its best fit.

    Parameters
    ----------
    settings
        The case.
    verdicts, measurements, calibrated
        Files of the case: JSON, Parquet, and YAML if its gripper was calibrated.
    """
    problem = settings.problem.calibrated(calibrated)
    found = {item["quantity"]: item["value"] for item in read_verdicts(verdicts)["quantities"]}
    values = {name: found[name] for name in problem.searched.names}
    recorded = read_measurements(measurements, [TRACE])
    fit = fit_of(problem, {**problem.fixed, **values}, recorded, TRACE)
    return draw_fit(fit, f"best fit ({settings.trace})", settings.title, settings.axis_rad)


JUDGED_FIT = drawing(
    draw,
    name="judged_fit",
    caption="The trace that this case's verdicts are about, its best fit, and below the "
    "residuals of the trace (points) and of the target (line).",
    settings=settings,
    reads={
        "verdicts": the(PATH),
        "measurements": Reads(
            lambda plan, job: [plan.batch_of_seed(MEASUREMENTS, job["case"], TRACE)], one=True
        ),
        "calibrated": calibration_of(),
    },
    cases=lambda study: study.cases,
    rule="case_figures",
    weight=JUDGEMENT,
)
