"""The study in one picture: one fit, and how all identifications scatter about the truth."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.results import SHOWN_SEEDS, best_fit, first_seeds, scale_of, seeds_in_words
from biogrip.figures.style import (
    ALL_SEEDS,
    FITTED,
    MEASURED,
    PAGE_IN,
    PAPER,
    TARGET,
    figure,
    panel,
)
from biogrip.identify.identifications import at_noise_floor, read_identifications
from biogrip.study import build

_WORST = 1e3
_TITLE_LETTERS = 19


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw the first case's best fit, and identified over target values of a few cases.

    Parameters
    ----------
    settings
        ``cases``: settings of each, with the ``method`` to show;
        ``noise_floor_tolerance``.
    inputs
        Identifications of the cases in their order (CSV), measurements of the
        first (Parquet).
    """
    identifications = [path for path in inputs if path.suffix == ".csv"]
    others = [path for path in inputs if path.suffix != ".csv"]
    cases = list(settings["cases"].values())
    drawn = figure(PAGE_IN, 3.0)
    axes = drawn.subplots(1, 1 + len(cases), width_ratios=[2] + [1.05] * len(cases))
    _fit(axes[0], cases[0], identifications[0], others)
    seeds = 0
    for index, (case, path) in enumerate(zip(cases, identifications, strict=True)):
        found = read_identifications(path, case["method"])
        seeds = len(found)
        tolerance = settings["noise_floor_tolerance"]
        _scatter(axes[index + 1], case, first_seeds(found), tolerance, index)
    legend: dict[str, Any] = {}
    for panel_axes in axes[1:]:
        legend |= {
            label: handle
            for handle, label in zip(*panel_axes.get_legend_handles_labels(), strict=True)
        }
    drawn.legend(
        legend.values(),
        legend.keys(),
        loc="outside lower right",
        ncols=4,
        markerscale=2.5,
        title=seeds_in_words(seeds) if seeds > SHOWN_SEEDS else None,
    )
    return drawn


def _fit(axes: Axes, case: dict[str, Any], identifications: Path, others: list[Path]) -> None:
    fit = best_fit(case, identifications, others)
    factor, unit = scale_of(fit.fitted_rad, "rad")
    axes.plot(
        fit.time_s,
        factor * fit.measured_rad,
        ".",
        color=MEASURED,
        markersize=1.2,
        rasterized=True,
    )
    axes.plot([], [], ".", color=MEASURED, label="noisy measurement", markersize=4)
    if fit.target_rad is not None:
        axes.plot(fit.time_s, factor * fit.target_rad, color=TARGET, label="target")
    axes.plot(fit.time_s, factor * fit.fitted_rad, "--", color=FITTED, label="best fit")
    axes.set_ylim(top=1.55 * factor * fit.measured_rad.max())
    axes.set_xlim(fit.time_s[0], fit.time_s[-1])
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"closing rotation ({unit})")
    axes.legend(loc="upper right")
    panel(axes, "a", case["title"])


def _scatter(
    axes: Axes,
    case: dict[str, Any],
    found: pd.DataFrame,
    tolerance: float,
    index: int,
) -> None:
    reached = at_noise_floor(found, tolerance)
    ticks = []
    for x, (label, columns, target, paper) in enumerate(_quantities(case)):
        ratio = _clipped(found[columns].sum(axis=1).to_numpy(float) / target)
        # A fixed sideways scatter, by seed, keeps points apart.
        place = x + 0.5 * ((found["seed"].to_numpy() * 0.618034) % 1 - 0.5)
        style: dict[str, Any] = {
            "linestyle": "",
            "marker": "o",
            "markersize": 2,
            "alpha": 0.6,
            "markeredgewidth": 0,
        }
        axes.plot(
            place[~reached],
            ratio[~reached],
            color=ALL_SEEDS,
            label="fit above it",
            **style,
        )
        axes.plot(
            place[reached],
            ratio[reached],
            color=FITTED,
            label="fit at the noise floor",
            **style,
        )
        if paper is not None:
            axes.plot(
                [x - 0.4, x + 0.4],
                2 * [_clipped(np.array([paper / target]))[0]],
                color=PAPER,
                label="paper",
            )
        ticks.append(label)
    axes.axhline(1, color=TARGET, linewidth=0.8, label="truth")
    axes.set_yscale("log")
    axes.set_ylim(1 / (2 * _WORST), 2 * _WORST)
    axes.set_yticks([1e-3, 1e-2, 0.1, 1, 10, 100, 1e3])
    if index:
        axes.set_yticklabels([])
    else:
        axes.set_ylabel("identified / target")
    axes.set_xticks(range(len(ticks)), ticks)
    panel(axes, "bcd"[index], case["title"], most_letters=_TITLE_LETTERS)


def _quantities(
    case: dict[str, Any],
) -> list[tuple[str, list[str], float, float | None]]:
    """Label, columns, target and the paper's value of each parameter, and of c + c_p."""
    identified = case["published"].get("identified", {})
    found = []
    for group in build.sample_model(case).quantities:
        target = sum(case["parameters"][parameter.name] for parameter in group)
        known = all(parameter.name in identified for parameter in group)
        paper = sum(identified[parameter.name] for parameter in group) if known else None
        label = "+".join(parameter.symbol for parameter in group)
        if target > 0:
            found.append((label, [p.column for p in group], target, paper))
    return found


def _clipped(ratio: Array) -> Array:
    """Put what is off the axis on its edge."""
    clipped: Array = np.clip(ratio, 1 / _WORST, _WORST)
    return clipped
