"""Figures 9, 11 and 12: target, noisy trace, fits, and the residuals; and the force of the jaws."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.fit.experiment import Experiment
from biogrip.physics.instruments import INSTRUMENTS, ROTATION, Channel
from biogrip.physics.noise import within
from biogrip.physics.protocol import is_storage
from biogrip.physics.simulation import jaw_force, simulated_response
from biogrip.physics.unilateral import UnilateralResponse, unilateral_response
from biogrip.records.identifications import ALL, basins, read_identifications, read_verdicts
from biogrip.records.rows import seeds_of
from biogrip.records.traces import Measurements, read_measurements, read_target
from biogrip.stages.identification import experiment_for
from biogrip.stages.judgement import TRACE
from biogrip.study.study import Case

SHOWN_SEEDS = 100
"""Most seeds drawn individually; figures show the first ones."""


@dataclass(frozen=True)
class Fit:
    """A trace and the response that was fitted to it."""

    time_s: Array
    """Sampling times, (n_samples,)."""
    target: Array | None
    """Noise-free rotation, (n_samples,); None if the trace was recorded."""
    measured: Array
    """Noisy rotation, (n_samples,)."""
    fitted: Array
    """Fitted rotation, (n_samples,)."""
    sd: Array | None = None
    """Standard deviations of the readings, (n_samples,), where they are known."""
    read: Channel = ROTATION
    """What is read."""


def first_of_basins(found: pd.DataFrame, case: Case) -> dict[str, pd.Series]:
    """Return the first run of each of the `basins`, by what it is called in a legend."""
    if len(found) == 1:
        return {"the only trace": found.iloc[0]}
    return {
        f"seed {runs['seed'].iloc[0]}" + f", {name}" * (name != ALL): runs.iloc[0]
        for name, runs in basins(found, case.study.near_noise_tolerance).items()
    }


def fits_of_basins(
    case: Case, identifications: Path, measurements: list[Path], calibrated: list[Path]
) -> dict[str, Fit]:
    """Return the fit of the first run of each basin, by label, from files of a case."""
    found = read_identifications(identifications, case, case.study.shown_method.name)
    fits = {}
    for words, run in first_of_basins(found, case).items():
        seed = int(run["seed"])
        values = {p.name: float(run[p.column]) for p in case.sample.model.parameters}
        holding = next(path for path in measurements if seed in seeds_of(path.stem))
        recorded = read_measurements(holding, [seed])
        experiment = experiment_for(case.experiment, recorded, calibrated)
        fits[f"fit ({words})"] = _fit_of_seed(experiment, values, recorded, seed)
    return fits


def fit_of(
    problem: Experiment,
    parameters: Mapping[str, float],
    time_s: Array,
    measured: Array,
    sd: Array | None = None,
    target: Array | None = None,
) -> Fit:
    """Return a trace, and the response of parameters with nuisance terms fitted.

    Fixed parameters need not be given.
    """
    network = problem.model.sample({**parameters, **problem.fixed})
    device = problem.gripper, network, problem.torque
    simulated = simulated_response(*device, time_s, nonlinear=False)[0]
    fitted = simulated + within(problem.nuisance(time_s), measured - simulated, sd)
    return Fit(time_s, target, measured, fitted, sd, problem.instrument.read)


def _fit_of_seed(
    problem: Experiment, parameters: Mapping[str, float], made: Measurements, seed: int
) -> Fit:
    return fit_of(problem, parameters, made.time_s, made.readings[seed], made.sd, made.target)


def first_seeds(found: pd.DataFrame) -> pd.DataFrame:
    """Return the identifications of seeds that are drawn individually."""
    return found[found["seed"] < SHOWN_SEEDS]


def seeds_in_words(count: int) -> str:
    """Return in words how many seeds are drawn individually."""
    if count == 1:
        return "the only trace"
    return f"all {count} seeds" if count <= SHOWN_SEEDS else f"first {SHOWN_SEEDS} of {count} seeds"


def scale_of(values: Array, unit: str) -> tuple[float, str]:
    """Return factor and unit that put values between 1 and 1000, e.g. ``(1e6, "µrad")``.

    A unit that is no single word, as N/m, has no prefix.
    """
    if not unit.isalpha():
        return 1.0, unit
    largest = float(np.max(np.abs(values)))
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ")):
        if largest * factor >= 1:
            return factor, prefix + unit
    return 1e9, f"n{unit}"


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
    case: Case, verdicts: Path, measurements: list[Path], calibrated: list[Path]
) -> Figure:
    """Draw the judged trace of a case and its best fit."""
    fit = judged_fit(case, read_verdicts(verdicts), measurements[0], calibrated)
    trace = "recorded trace" if case.recorded else f"seed {TRACE}"
    return draw_fit({f"best fit ({trace})": fit}, case.title, case.published.axis_rad)


def judged_fit(
    case: Case, verdicts: Mapping[str, Any], measurements: Path, calibrated: list[Path]
) -> Fit:
    """Return the judged trace of a case and its best fit."""
    recorded = read_measurements(measurements, [TRACE])
    experiment = experiment_for(case.experiment, recorded, calibrated)
    found = {item["quantity"]: item["value"] for item in verdicts["quantities"]}
    return _fit_of_seed(experiment, found, recorded, TRACE)


def draw_traces(axes: Axes, fits: Mapping[str, Fit]) -> tuple[float, str]:
    """Draw a trace, its target, its fit and others, by label; return factor and unit."""
    fit = next(iter(fits.values()))
    factor, unit = scale_of(fit.fitted, fit.read.unit)
    axes.plot(fit.time_s, factor * fit.measured, color=style.MEASURED, **_readings(len(fit.time_s)))
    kind = "recorded trace" if fit.target is None else "noisy measurement"
    axes.plot([], [], ".", color=style.MEASURED, markersize=4, label=kind)
    if fit.target is not None:
        axes.plot(
            fit.time_s, factor * fit.target, color=style.TARGET, linewidth=2.4, label="target"
        )
    for (label, each), color in zip(fits.items(), style.RUNS, strict=False):
        axes.plot(each.time_s, factor * each.fitted, color=color, label=label)
    axes.set_ylabel(with_unit(fit.read.title, unit))
    return factor, unit


def _readings(count: int) -> dict[str, Any]:
    """Style of readings, the paler the more there are, for curves to be seen."""
    return _READINGS | {"alpha": max(min(1.0, _FEW / count), _PALEST)}


def _means(axes: Axes, time_s: Array, residual: Array) -> None:
    if len(residual) <= _FEW:
        return
    times, parts = np.array_split(time_s, _PARTS), np.array_split(residual, _PARTS)
    error = [part.std(ddof=1) / np.sqrt(len(part)) for part in parts]
    at, mean = [part.mean() for part in times], [part.mean() for part in parts]
    axes.errorbar(at, mean, error, fmt="o", color=style.BLUE, markersize=2, linewidth=0.8, zorder=3)


def draw_fit(fits: Mapping[str, Fit], title: str, axis_rad: tuple[float, ...] = ()) -> Figure:
    """Draw a trace, its fit and the residuals, on an axis that includes the paper's limits.

    Of further fits, which are to other traces of the same target, the target's residuals are drawn.
    """
    fit, *others = fits.values()
    if INSTRUMENTS[fit.read.name].sweeps:
        return draw_sweep(fit, title)
    drawn = style.figure(style.COLUMN_IN, 3.6)
    traces, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    factor, unit = draw_traces(traces, fits)
    low, high = (end([*axis_rad, end(fit.measured)]) for end in (np.min, np.max))
    margin = 0.02 * (high - low)
    traces.set_ylim(factor * (low - margin), factor * (high + margin))
    drawn.legend(loc="outside upper left", ncols=2)
    traces.set_title(style.literal(title))
    residual = fit.measured - fit.fitted
    residual = factor * residual if fit.sd is None else residual / fit.sd
    residuals.plot(fit.time_s, residual, color=style.MEASURED, **_readings(len(residual)))
    if fit.target is not None:
        residuals.plot(fit.time_s, factor * (fit.target - fit.fitted), color=style.TARGET)
    for other, color in zip(others, style.RUNS[1:], strict=False):
        left = factor * (np.asarray(other.target) - other.fitted)
        residuals.plot(other.time_s, left, color=color)
    _means(residuals, fit.time_s, residual)
    residuals.axhline(0, color=style.FITTED, linewidth=0.8)
    bound = 1.15 * float(np.max(np.abs(residual)))
    residuals.set_ylim(-bound, bound)
    residuals.set_ylabel(with_unit("residual", unit) if fit.sd is None else "residual / sd")
    residuals.set_xlabel("time (s)")
    residuals.set_xlim(fit.time_s[0], fit.time_s[-1])
    if style.is_over_decades(fit.time_s):
        residuals.set_xscale("log")
        if low > 0:
            traces.set(yscale="log", ylim=(0.8 * factor * low, 1.25 * factor * high))
    drawn.align_ylabels()
    return drawn


def draw_sweep(fit: Fit, title: str) -> Figure:
    """Draw both moduli of a sweep, their fit, and the residuals in percent of it."""
    drawn = style.figure(style.COLUMN_IN, 3.6)
    moduli, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    storage, look = is_storage(fit.time_s), {"linestyle": "", "markersize": 3}
    for name, of, marker, face in (
        ("storage", storage, "o", style.BLUE),
        ("loss", ~storage, "s", "white"),
    ):
        color = style.BLUE if name == "storage" else style.FITTED
        points: dict[str, Any] = look | {"marker": marker, "color": color, "markerfacecolor": face}
        omega, residual = np.abs(fit.time_s[of]), 100 * (fit.measured / fit.fitted - 1)[of]
        moduli.plot(omega, fit.measured[of], **points, label=f"{name} modulus")
        moduli.plot(omega, fit.fitted[of], "--", color=color, label=f"{name}, best fit")
        residuals.plot(omega, residual, **points)
    moduli.set(xscale="log", yscale="log", title=style.literal(title))
    moduli.set_ylabel(with_unit("modulus", fit.read.unit))
    drawn.legend(loc="outside upper left", ncols=2)
    residuals.axhline(0, color=style.MEASURED, linestyle="--", linewidth=0.8)
    residuals.set(xlabel="angular frequency (rad/s)", ylabel="residual (%)")
    drawn.align_ylabels()
    return drawn


def draw_force(case: Case, target: Path) -> Figure:
    """Draw the jaw force under bilateral contact, and the rotation with and without adhesion."""
    time_s, _, rotation = read_target(target, case.times_s)
    device = case.gripper, case.network, case.torque
    # Without inertia, since the jaws ring for less than a sampling interval after a step.
    sticking = jaw_force(*device, time_s, nonlinear=case.nonlinear_target, inertia=False)[0]
    drawn = style.figure(style.COLUMN_IN, 3.2)
    forces, rotations = drawn.subplots(2, 1, sharex=True, height_ratios=[1.25, 1])
    factor, unit = scale_of(sticking, "N")
    forces.axhline(0, color=style.BLACK, linewidth=0.6)
    forces.plot(time_s, factor * sticking, color=style.BLUE, label="jaws that hold the sample")
    negative = np.minimum(factor * sticking, 0)
    pulling = bool(negative.min() < -1e-9 * factor * np.abs(sticking).max())
    if pulling:
        forces.fill_between(
            time_s, negative, 0, color=style.ORANGE, alpha=0.35, linewidth=0, hatch="////",
            label="the jaws would have to pull",
        )  # fmt: skip
    apart = None
    if pulling and not case.nonlinear_target:
        apart = unilateral_response(*device, time_s)
        shown = _from_loss(apart, apart.jaw_force_N)
        forces.plot(time_s, factor * shown, "--", color=style.ORANGE, label="jaws that let go")
    forces.set_ylabel(f"jaw force ({unit})")
    low, high = float(negative.min()), factor * float(sticking.max())
    forces.set_ylim(low - 0.08 * (high - low), high + (0.62 if apart else 0.42) * (high - low))
    forces.legend(loc="upper right")
    forces.set_title(case.title)

    factor, unit = scale_of(rotation, "rad")
    name = "target" + (", jaws that let go" if case.unilateral else "")
    rotations.plot(time_s, factor * rotation, color=style.BLACK, label=name)
    if apart and not case.unilateral:
        shown = _from_loss(apart, apart.rotation[0])
        rotations.plot(time_s, factor * shown, "--", color=style.ORANGE, label="jaws that let go")
    rotations.set_ylabel(f"rotation ({unit})")
    low, high = (factor * float(end) for end in (min(rotation.min(), 0), rotation.max()))
    rotations.set_ylim(low, high + 0.4 * (high - low))
    rotations.set_xlabel("time (s)")
    rotations.set_xlim(time_s[0], time_s[-1])
    rotations.legend(loc="upper right", ncols=2)
    drawn.align_ylabels()
    return drawn


def _from_loss(found: UnilateralResponse, values: Array) -> Array:
    """Return values from the last sample before contact is first lost, NaN before."""
    lost = np.flatnonzero(~found.touching)
    start = max(lost[0] - 1, 0) if len(lost) else len(values)
    return np.where(np.arange(len(values)) >= start, values, np.nan)
