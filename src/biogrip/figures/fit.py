"""A trace, the responses fitted to it, and what they leave."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.fit.experiment import Experiment
from biogrip.physics.instruments import INSTRUMENTS, ROTATION, Channel
from biogrip.physics.noise import within
from biogrip.physics.protocol import is_storage
from biogrip.physics.response import simulated_response


@dataclass(frozen=True)
class FittedTrace:
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
    curve: tuple[Array, Array] | None = None
    """Times and fitted rotations between few readings, each (n,)."""


def fit_of(
    problem: Experiment,
    parameters: Mapping[str, float],
    time_s: Array,
    measured: Array,
    sd: Array | None = None,
    target: Array | None = None,
) -> FittedTrace:
    """Return a trace, and the response of parameters with nuisance terms fitted.

    Fixed parameters need not be given.
    """
    network = problem.model.sample({**parameters, **problem.fixed})
    device = problem.gripper, network, problem.torque
    simulated = simulated_response(*device, time_s)[0]
    added = within(problem.nuisance(time_s), measured - simulated, sd)
    given = time_s, target, measured, simulated + added, sd, problem.instrument.read
    if len(time_s) > _FEW_READINGS or problem.instrument.sweeps:
        return FittedTrace(*given)
    spaced = np.geomspace if style.is_over_decades(time_s) else np.linspace
    between = np.union1d(spaced(time_s[0], time_s[-1], _FEW_READINGS)[1:-1], time_s)
    course = simulated_response(*device, between)[0] + np.interp(between, time_s, added)
    return FittedTrace(*given, curve=(between, course))


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
_FEW_READINGS, _PALEST, _PARTS, _FEWEST = 300, 0.25, 40, 20


def draw_traces(axes: Axes, fits: Mapping[str, FittedTrace]) -> tuple[float, str]:
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
    for (label, fitted), color, dash in zip(fits.items(), style.RUNS, ("-", "--"), strict=False):
        times, course = fitted.curve or (fitted.time_s, fitted.fitted)
        axes.plot(times, factor * course, dash, color=color, label=label)
    axes.set_ylabel(with_unit(fit.read.title, unit))
    return factor, unit


def _readings(count: int) -> dict[str, Any]:
    """Style of readings, the paler the more, and the larger the fewer there are."""
    look = {"alpha": max(min(1.0, _FEW_READINGS / count), _PALEST)}
    look["clip_on"] = count > _FEW_READINGS
    few = max(1.0, _FEW_READINGS / max(count, _FEWEST))
    return _READINGS | look | {"markersize": few**0.75 * _READINGS["markersize"]}


def _means(axes: Axes, time_s: Array, residual: Array) -> None:
    if len(residual) <= _FEW_READINGS:
        return
    times, parts = np.array_split(time_s, _PARTS), np.array_split(residual, _PARTS)
    error = [part.std(ddof=1) / np.sqrt(len(part)) for part in parts]
    at, mean = [part.mean() for part in times], [part.mean() for part in parts]
    look: dict[str, Any] = {"color": style.BLUE, "markersize": 2, "linewidth": 0.8, "zorder": 3}
    axes.errorbar(at, mean, error, fmt="o", label="means of residuals", **look)


def draw_fit(
    fits: Mapping[str, FittedTrace], title: str, axis_rad: tuple[float, ...] = ()
) -> Figure:
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
    drawn.legend(loc="outside upper left", ncols=2)
    drawn.align_ylabels()
    return drawn


def draw_sweep(fit: FittedTrace, title: str) -> Figure:
    """Draw both moduli of a sweep, their fit, and the residuals in percent of it."""
    drawn = style.figure(style.COLUMN_IN, 3.6)
    moduli, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    storage, look = is_storage(fit.time_s), {"linestyle": "", "markersize": 3}
    for name, of, marker, face in (
        ("storage", storage, "o", style.BLUE),
        ("loss", ~storage, "s", "white"),
    )[not np.any(storage) :]:
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
