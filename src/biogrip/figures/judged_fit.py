"""Fit of the trace that the verdicts of a case are about."""

from pathlib import Path

from matplotlib.figure import Figure

from biogrip.figures.fit import draw_fit
from biogrip.figures.results import fit_of
from biogrip.records.identifications import read_verdicts
from biogrip.records.traces import read_measurements
from biogrip.stages.judgement import TRACE
from biogrip.study.study import Case


def draw(case: Case, verdicts: Path, measurements: Path, calibrated: list[Path]) -> Figure:
    """Draw the judged trace of a case and its best fit."""
    problem = case.problem.calibrated(calibrated)
    found = {item["quantity"]: item["value"] for item in read_verdicts(verdicts)["quantities"]}
    values = {name: found[name] for name in problem.searched.names}
    recorded = read_measurements(measurements, [TRACE])
    fit = fit_of(problem, {**problem.fixed, **values}, recorded, TRACE)
    trace = "recorded trace" if case.recorded else f"seed {TRACE}"
    return draw_fit(fit, f"best fit ({trace})", case.title, case.published.axis_rad)
