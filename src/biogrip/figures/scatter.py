"""Errors over seeds as distributions, beside the Cramer-Rao bound and the paper's value."""

from collections.abc import Mapping
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from biogrip.arrays import Array
from biogrip.figures.fit import SHOWN_SEEDS, seeds_in_words
from biogrip.figures.style import (
    PAPER,
    SHADE,
    TARGET,
    line_of,
    panel,
    points_within,
    row_of_panels,
)
from biogrip.judging.likelihood import bound
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED
from biogrip.physics.noise import standard_deviation
from biogrip.records.identifications import read_identifications, read_verdicts
from biogrip.records.traces import read_target
from biogrip.study.study import Case

# Bounds on both sides of 1 that an axis shows, more where quartiles are further off; where that
# leaves no room above zero, it shows decades.
_WIDTHS, _LOOSE, _MOST_DECADES = 8.0, 0.95, 4
# Points at the edge would make the layout leave them room.
_DOTS: dict[str, Any] = {
    "linestyle": "", "marker": "o", "markersize": 2, "markeredgewidth": 0, "alpha": 0.55,
    "clip_on": False, "in_layout": False,
}  # fmt: skip


def draw_scatter(
    case: Case, identifications: Path, target: Path, expected: Path, calibrated: list[Path]
) -> Figure:
    """Draw identified over target for every quantity and method."""
    items = read_verdicts(expected)["quantities"]
    verdicts = {item["quantity"]: item["verdict"] for item in items}
    found = read_identifications(identifications, case)
    experiment = case.experiment.calibrated(calibrated)
    time_s, _, rotation = read_target(target, case.times_s)
    log_truth = experiment.logs(case.parameters)
    _, sensitivity = experiment.of(time_s, rotation).residuals(log_truth)
    noise_sd = standard_deviation(rotation, case.noise)
    quantities = parameters_and_sum(experiment.searched)
    drawn, grid = row_of_panels(len(quantities), 3.1)
    for index, (axes, quantity) in enumerate(zip(grid, quantities, strict=True)):
        names = [experiment.searched.parameters[i] for i in quantity.members]
        value = sum(case.parameters[p.name] for p in names)
        if value == 0:
            axes.axis("off")
            continue
        ratios = found[[p.column for p in names]].sum(axis=1) / value
        limit = bound(sensitivity, noise_sd, log_truth, quantity)
        verdict = verdicts[quantity.label]
        # The bound is a tangent at the truth: no use if the quantity is not determined, or if it
        # is zero.
        known = limit if limit and verdict == DETERMINED else np.inf
        _quantity(axes, case, found["method"], ratios.to_numpy(float), known)
        _paper(axes, case.published.identified, [p.name for p in names], value)
        panel(axes, "abcdefghijklmnopqrstuvwxyz"[index], _title(quantity, known, verdict), 60)
        if index == 0:
            axes.set_ylabel("identified / target")
    _legend(drawn, case, list(found["method"].unique()), found["seed"].nunique())
    return drawn


def _quantity(
    axes: Axes, case: Case, methods: "pd.Series[str]", ratios: Array, limit: float
) -> None:
    """Draw one column of points per method, with points beyond the axis at its edge."""
    names = list(methods.unique())
    of_methods = [ratios[(methods == name).to_numpy()] for name in names]
    quartiles = np.percentile(of_methods, [25, 50, 75], axis=1).T
    reach = max(_WIDTHS * limit, 1.1 * float(np.max(np.abs(quartiles - 1))))
    loose = reach > _LOOSE
    ends = np.log10(np.maximum(quartiles, 10.0**-_MOST_DECADES))
    decades = float(np.clip(np.ceil(np.max(np.abs(ends))), 1, _MOST_DECADES))
    bottom, top = (10**-decades, 10**decades) if loose else (1 - reach, 1 + reach)
    for place, (name, mine) in enumerate(zip(names, of_methods, strict=True)):
        shown = mine[:SHOWN_SEEDS]
        # A fixed sideways scatter keeps points apart.
        x = place + 0.6 * ((np.arange(len(shown)) * 0.618034) % 1 - 0.5)
        style = _DOTS | {"color": line_of(case.study.identifiers[name])["color"]}
        points, ends = np.column_stack([x, shown]), ((-np.inf, bottom), (np.inf, top))
        points_within(axes, points, *ends, style, edge_size=3)
        low, middle, high = np.clip(quartiles[place], bottom, top)
        axes.plot([place, place], [low, high], color=TARGET, linewidth=1.0)
        axes.plot([place - 0.3, place + 0.3], [middle, middle], color=TARGET, linewidth=1.4)
    if np.isfinite(limit):
        half = NormalDist().inv_cdf((1 + case.confidence) / 2) * limit
        # Of the logarithm, straight where the axis is.
        low, high = (np.exp(-half), np.exp(half)) if loose else (1 - half, 1 + half)
        axes.axhspan(low, high, color=SHADE, zorder=0, linewidth=0)
    axes.axhline(1, color=TARGET, linewidth=0.6)
    if loose:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(numticks=5))
        axes.minorticks_off()
    else:
        axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set(ylim=(bottom, top), xlim=(-0.6, len(names) - 0.4))
    axes.set_xticks([])


def _paper(axes: Axes, identified: Mapping[str, float], names: list[str], target: float) -> None:
    if all(name in identified for name in names):
        low, high = axes.get_ylim()
        value = float(np.clip(sum(identified[name] for name in names) / target, low, high))
        axes.axhline(value, color=PAPER, linewidth=1.2, linestyle=(0, (4, 2)))


def _title(quantity: Quantity, limit: float, verdict: str) -> str:
    known = f"{100 * limit:.2g} %" if np.isfinite(limit) else verdict.split(" above")[0]
    return f"{quantity.symbol}: {known}"


def _legend(drawn: Figure, case: Case, methods: list[str], seeds: int) -> None:
    axes = drawn.axes[0]
    marks = [(case.study.identifiers[name].title, "o", name) for name in methods]
    handles: list[Any] = []
    for label, marker, name in [*marks, ("beyond the axis", "^", "")]:
        color = line_of(case.study.identifiers[name])["color"] if name else TARGET
        style: dict[str, Any] = {"color": color, "markersize": 4, "markeredgewidth": 0}
        handles += axes.plot([], [], marker, label=label, **style)
    label = f"{100 * case.confidence:g} % by the Cramér-Rao bound (named above), rest known"
    handles.append(axes.fill([], [], color=SHADE, label=label)[0])
    if case.published.identified:
        handles += axes.plot([], [], color=PAPER, linestyle=(0, (4, 2)), label="paper")
    drawn.legend(handles=handles, loc="outside lower left", ncols=3)
    few = "" if seeds <= SHOWN_SEEDS else f": {seeds_in_words(seeds)}, quartiles of all"
    drawn.suptitle(case.title + few, x=0.01, ha="left", fontsize=8)
