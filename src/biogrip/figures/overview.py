"""Overview of a study: one fit, and the scatter of all identifications about the truth."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.figures.fit import draw_traces
from biogrip.figures.results import (
    SHOWN_SEEDS,
    TypicalFit,
    first_seeds,
    seeds_in_words,
    typical_fit,
)
from biogrip.figures.style import (
    ALL_SEEDS,
    FITTED,
    PAGE_IN,
    PAPER,
    TARGET,
    figure,
    panel,
)
from biogrip.fit.methods import near_noise, near_noise_words
from biogrip.physics.models import Truth
from biogrip.records.identifications import bounded_on_a_side, read_identifications, read_verdicts
from biogrip.study.study import Study

_WORST = 1e3
_TITLE_LETTERS = 19


_MOST_CASES = 3


def shown_cases(study: Study) -> list[str]:
    """Return names of the first simulated cases, as many as fit."""
    return study.simulated[:_MOST_CASES]


def draw(
    study: Study,
    identifications: list[Path],
    expected: list[Path],
    measurements: list[Path],
    calibrated: list[Path],
) -> Figure:
    """Draw the first case's typical fit, and identified over target values of a few cases."""
    cases = list(study.cases.values())
    drawn = figure(PAGE_IN, 3.0)
    axes = drawn.subplots(1, 1 + len(cases), width_ratios=[2] + [1.05] * len(cases))
    problem = cases[0].problem.calibrated(calibrated)
    fit = typical_fit(problem, study.shown, identifications[0], measurements)
    _fit(axes[0], cases[0].truth, fit)
    seeds = 0
    for index, (case, path) in enumerate(zip(cases, identifications, strict=True)):
        found = read_identifications(path, study.shown)
        seeds = len(found)
        tolerance = study.near_noise_tolerance
        bounded = bounded_on_a_side(read_verdicts(expected[index]))
        _scatter(axes[index + 1], case.truth, first_seeds(found), tolerance, index, bounded)
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
        ncols=5,
        markerscale=2.5,
        title=seeds_in_words(seeds) if seeds > SHOWN_SEEDS else None,
    )
    return drawn


def _fit(axes: Axes, case: Truth, fit: TypicalFit) -> None:
    factor, _ = draw_traces(axes, fit, f"typical fit (seed {fit.seed})")
    axes.set_ylim(top=1.55 * factor * fit.measured_rad.max())
    axes.set(xlim=(fit.time_s[0], fit.time_s[-1]), xlabel="time (s)")
    axes.legend(loc="upper right")
    panel(axes, "a", case.title)


def _scatter(
    axes: Axes,
    case: Truth,
    found: pd.DataFrame,
    tolerance: float,
    index: int,
    bounded: set[str],
) -> None:
    reached = near_noise(found, tolerance)
    words = near_noise_words(tolerance)
    ticks = []
    quantities = [item for item in _quantities(case) if item[0] in bounded]
    for x, (_, label, columns, target, paper) in enumerate(quantities):
        ratio = found[columns].sum(axis=1).to_numpy(float) / target
        place = x + 0.5 * ((np.arange(len(ratio)) * 0.618034) % 1 - 0.5)
        for which, color, name in ((~reached, ALL_SEEDS, "other fits"), (reached, FITTED, words)):
            _points(
                axes, place[which], ratio[which], color, f"fit {words}" if name == words else name
            )
        if paper is not None:
            shown = float(np.clip(paper / target, 1 / _WORST, _WORST))
            axes.plot([x - 0.4, x + 0.4], [shown, shown], color=PAPER, label="paper")
        ticks.append(label)
    axes.axhline(1, color=TARGET, linewidth=0.8, label="truth")
    axes.set_yscale("log")
    axes.plot([], [], "^", color=TARGET, markersize=1.6, label="beyond the axis")
    axes.set_ylim(1 / (2 * _WORST), 2 * _WORST)
    axes.set_yticks([1e-3, 1e-2, 0.1, 1, 10, 100, 1e3])
    if index:
        axes.set_yticklabels([])
    else:
        axes.set_ylabel("identified / target")
    axes.set_xticks(range(len(ticks)), ticks)
    panel(axes, "bcd"[index], case.title, most_letters=_TITLE_LETTERS)


def _quantities(
    case: Truth,
) -> list[tuple[str, str, list[str], float, float | None]]:
    """Return name, label, columns, target and paper's value of each parameter, and of c + c_p."""
    identified = case.published.identified
    found = []
    for group in case.model.quantities:
        target = sum(case.parameters[parameter.name] for parameter in group)
        known = all(parameter.name in identified for parameter in group)
        paper = sum(identified[parameter.name] for parameter in group) if known else None
        label = "+".join(parameter.symbol for parameter in group)
        if target > 0:
            name = " + ".join(parameter.name for parameter in group)
            found.append((name, label, [p.column for p in group], target, paper))
    return found


def _points(axes: Axes, place: NDArray[np.floating], ratio: Array, color: str, label: str) -> None:
    """Draw points, with triangles at the edge for points beyond the axis."""
    style: dict[str, Any] = {"color": color, "linestyle": "", "markeredgewidth": 0, "alpha": 0.55}
    inside = (ratio > 1 / _WORST) & (ratio < _WORST)
    axes.plot(place[inside], ratio[inside], marker="o", markersize=2.2, label=label, **style)
    edges = (("v", ratio <= 1 / _WORST, 1 / _WORST), ("^", ratio >= _WORST, _WORST))
    for marker, outside, edge in edges:
        height = np.full(int(outside.sum()), edge)
        axes.plot(place[outside], height, marker=marker, markersize=3.5, **style)


def _first(study: Study) -> str:
    return shown_cases(study)[0]
