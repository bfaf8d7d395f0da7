"""Figures 9, 11 and 12: target, noisy trace, fits, and the residuals."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures.results import Fit, fit_of, fits_of_basins, scale_of_fit
from biogrip.figures.style import (
    BLUE,
    COLUMN_IN,
    FITTED,
    MEASURED,
    RUNS,
    TARGET,
    figure,
    is_over_decades,
    literal,
)
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import is_storage
from biogrip.records.identifications import read_verdicts
from biogrip.records.traces import read_measurements
from biogrip.stages.judgement import TRACE, experiment_for
from biogrip.study.study import Case

_READINGS: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 1.2, "rasterized": True}
# Readings that are drawn in full colour; of more, residuals have means of so many parts.
_FEW, _PALEST, _PARTS = 300, 0.25, 40


def draw_fits(
    case: Case, identifications: Path, measurements: list[Path], calibrated: list[Path]
) -> Figure:
    """Draw the fit of the first run in each basin, beside the trace of the first of these."""
    fits = fits_of_basins(case, identifications, measurements, calibrated)
    return draw_fit(fits, case.title, case.published.axis_rad)


def draw_judged_fit(
    case: Case, verdicts: Path, measurements: Path, calibrated: list[Path]
) -> Figure:
    """Draw the judged trace of a case and its best fit."""
    fit = judged_fit(case, read_verdicts(verdicts), measurements, calibrated)
    trace = "recorded trace" if case.recorded else f"seed {TRACE}"
    return draw_fit({f"best fit ({trace})": fit}, case.title, case.published.axis_rad)


def judged_fit(
    case: Case, verdicts: Mapping[str, Any], measurements: Path, calibrated: list[Path]
) -> Fit:
    """Return the judged trace of a case and its best fit."""
    recorded = read_measurements(measurements, [TRACE])
    experiment = experiment_for(case.experiment, recorded, calibrated)
    found = {item["quantity"]: item["value"] for item in verdicts["quantities"]}
    values = {name: found[name] for name in experiment.searched.names}
    return fit_of(experiment, {**experiment.fixed, **values}, recorded, TRACE)


def draw_traces(axes: Axes, fits: Mapping[str, Fit]) -> tuple[float, str]:
    """Draw a trace, its target, its fit and others, by label; return factor and unit."""
    fit = next(iter(fits.values()))
    factor, unit = scale_of_fit(fit)
    axes.plot(fit.time_s, factor * fit.measured, color=MEASURED, **_readings(len(fit.time_s)))
    kind = "recorded trace" if fit.target is None else "noisy measurement"
    axes.plot([], [], ".", color=MEASURED, markersize=4, label=kind)
    if fit.target is not None:
        axes.plot(fit.time_s, factor * fit.target, color=TARGET, linewidth=2.4, label="target")
    for (label, each), color in zip(fits.items(), RUNS, strict=False):
        axes.plot(each.time_s, factor * each.fitted, color=color, label=label)
    axes.set_ylabel(with_unit(fit.read.title, unit))
    return factor, unit


def _readings(count: int) -> dict[str, Any]:
    """Style of readings, the paler the more there are, for curves to be seen."""
    return _READINGS | {"alpha": max(min(1.0, _FEW / count), _PALEST)}


def _means(axes: Axes, time_s: Array, residual: Array) -> None:
    """Draw means of a long trace's residuals, each with its standard error."""
    if len(residual) <= _FEW:
        return
    times, parts = np.array_split(time_s, _PARTS), np.array_split(residual, _PARTS)
    error = [part.std(ddof=1) / np.sqrt(len(part)) for part in parts]
    at, mean = [part.mean() for part in times], [part.mean() for part in parts]
    axes.errorbar(at, mean, error, fmt="o", color=BLUE, markersize=2, linewidth=0.8, zorder=3)


def draw_fit(fits: Mapping[str, Fit], title: str, axis_rad: tuple[float, ...] = ()) -> Figure:
    """Draw a trace, its fit and the residuals, on an axis that includes the paper's limits.

    Of further fits, which are to other traces of the same target, the target's residuals are drawn.
    """
    fit, *others = fits.values()
    if INSTRUMENTS[fit.read.name].sweeps:
        return draw_sweep(fit, title)
    drawn = figure(COLUMN_IN, 3.6)
    traces, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    factor, unit = draw_traces(traces, fits)
    low, high = (end([*axis_rad, end(fit.measured)]) for end in (np.min, np.max))
    margin = 0.02 * (high - low)
    traces.set_ylim(factor * (low - margin), factor * (high + margin))
    drawn.legend(loc="outside upper left", ncols=2)
    traces.set_title(literal(title))
    residual = fit.measured - fit.fitted
    residual = factor * residual if fit.sd is None else residual / fit.sd
    residuals.plot(fit.time_s, residual, color=MEASURED, **_readings(len(residual)))
    if fit.target is not None:
        residuals.plot(fit.time_s, factor * (fit.target - fit.fitted), color=TARGET)
    for other, color in zip(others, RUNS[1:], strict=False):
        left = factor * (np.asarray(other.target) - other.fitted)
        residuals.plot(other.time_s, left, color=color)
    _means(residuals, fit.time_s, residual)
    residuals.axhline(0, color=FITTED, linewidth=0.8)
    bound = 1.15 * float(np.max(np.abs(residual)))
    residuals.set_ylim(-bound, bound)
    residuals.set_ylabel(with_unit("residual", unit) if fit.sd is None else "residual / sd")
    residuals.set_xlabel("time (s)")
    residuals.set_xlim(fit.time_s[0], fit.time_s[-1])
    if is_over_decades(fit.time_s):
        residuals.set_xscale("log")
        if low > 0:
            traces.set(yscale="log", ylim=(0.8 * factor * low, 1.25 * factor * high))
    drawn.align_ylabels()
    return drawn


def draw_sweep(fit: Fit, title: str) -> Figure:
    """Draw both moduli of a sweep, their fit, and the residuals in percent of it."""
    drawn = figure(COLUMN_IN, 3.6)
    moduli, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    storage, style = is_storage(fit.time_s), {"linestyle": "", "markersize": 3}
    for name, of, marker, face in (
        ("storage", storage, "o", BLUE),
        ("loss", ~storage, "s", "white"),
    ):
        color = BLUE if name == "storage" else FITTED
        points: dict[str, Any] = style | {"marker": marker, "color": color, "markerfacecolor": face}
        omega, residual = np.abs(fit.time_s[of]), 100 * (fit.measured / fit.fitted - 1)[of]
        moduli.plot(omega, fit.measured[of], **points, label=f"{name} modulus")
        moduli.plot(omega, fit.fitted[of], "--", color=color, label=f"{name}, best fit")
        residuals.plot(omega, residual, **points)
    moduli.set(xscale="log", yscale="log", title=literal(title))
    moduli.set_ylabel(with_unit("modulus", fit.read.unit))
    drawn.legend(loc="outside upper left", ncols=2)
    residuals.axhline(0, color=MEASURED, linestyle="--", linewidth=0.8)
    residuals.set(xlabel="angular frequency (rad/s)", ylabel="residual (%)")
    drawn.align_ylabels()
    return drawn
