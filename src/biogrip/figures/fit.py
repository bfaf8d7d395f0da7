"""Figures 9, 11 and 12: target, noisy measurement, best fit and residual."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from biogrip.figures.results import best_fit, scale_of
from biogrip.figures.style import COLUMN_IN, FITTED, MEASURED, TARGET, figure


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw the best fit of a case.

    Parameters
    ----------
    settings
        ``title``, ``model``, ``gripper``, ``protocol``; ``method``, and its ``step``.
    inputs
        Identifications (CSV), then measurements (Parquet) of the case.
    """
    fit = best_fit(settings, inputs[0], inputs[1:])
    factor, unit = scale_of(fit.fitted_rad, "rad")
    drawn = figure(COLUMN_IN, 3.4)
    traces, residuals = drawn.subplots(2, 1, sharex=True, height_ratios=[2.4, 1])
    style: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 1.2, "rasterized": True}
    traces.plot(fit.time_s, factor * fit.measured_rad, color=MEASURED, **style)
    traces.plot([], [], ".", color=MEASURED, markersize=4, label="noisy measurement")
    if fit.target_rad is not None:
        traces.plot(fit.time_s, factor * fit.target_rad, color=TARGET, label="target")
    label = f"best fit (seed {fit.seed}, {settings['step']} {fit.generations})"
    traces.plot(fit.time_s, factor * fit.fitted_rad, "--", color=FITTED, label=label)
    traces.set_ylabel(f"closing rotation ({unit})")
    # Room for the legend above the data.
    low, high = factor * fit.measured_rad.min(), factor * fit.measured_rad.max()
    traces.set_ylim(low - 0.05 * (high - low), high + 0.38 * (high - low))
    traces.legend(loc="upper right")
    traces.set_title(settings["title"])
    residual = factor * (fit.measured_rad - fit.fitted_rad)
    residuals.plot(fit.time_s, residual, color=MEASURED, **style)
    if fit.target_rad is not None:
        residuals.plot(fit.time_s, factor * (fit.target_rad - fit.fitted_rad), color=TARGET)
    residuals.axhline(0, color=FITTED, linestyle="--", linewidth=0.8)
    bound = 1.15 * float(np.max(np.abs(residual)))
    residuals.set_ylim(-bound, bound)
    residuals.set_ylabel(f"residual ({unit})")
    residuals.set_xlabel("time (s)")
    residuals.set_xlim(fit.time_s[0], fit.time_s[-1])
    drawn.align_ylabels()
    return drawn
