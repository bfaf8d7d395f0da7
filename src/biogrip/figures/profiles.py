"""Profile likelihoods: increase of chi-squared over the values of each quantity."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures.style import (
    BLUE,
    FITTED,
    GREY,
    HIGHEST_INCREASE,
    SHADE,
    TARGET,
    decade_ticks,
    is_wide,
    panel,
    profile_limits,
    row_of_panels,
)
from biogrip.judging.likelihood import CERTAIN
from biogrip.records.identifications import read_verdicts
from biogrip.study.study import Case


def draw(case: Case, measured: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits."""
    others = [read_verdicts(path) for path in expected]
    return draw_profiles(case.title, case.parameters, read_verdicts(measured), others)


def draw_profiles(
    title: str,
    truths: Mapping[str, float],
    found: Mapping[str, Any],
    others: Sequence[Mapping[str, Any]] = (),
) -> Figure:
    """Draw profiles from loaded verdicts; see `draw`."""
    foreseen = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    quantities = found["quantities"]
    drawn, grid = row_of_panels(len(quantities), 2.5, sharey=True)
    for index, (axes, item) in enumerate(zip(grid, quantities, strict=True)):
        if item["quantity"] in foreseen:
            curve = _curve(foreseen[item["quantity"]]["profile"])
            axes.plot(*curve, color=GREY, label="expected without noise")
        axes.plot(*_curve(item["profile"]), color=FITTED, label="this trace")
        for increase, style, label in (
            (found["threshold"], "--", f"{100 * found['confidence']:g} %"),
            (found["certainty"], ":", f"{100 * CERTAIN:g} %, to close a side"),
        ):
            line = axes.axhline(increase, color=TARGET, linestyle=style, linewidth=0.7)
            if index == 0:
                line.set_label(label)
        _limits(axes, item)
        names = item["quantity"].split(" + ")
        if set(names) <= set(truths):
            truth = sum(truths[name] for name in names)
            axes.axvline(truth, color=TARGET, linewidth=0.7, label="truth")
        low, high = profile_limits(item)
        if is_wide(low, high):
            axes.set_xscale("log")
            axes.set_xticks(*decade_ticks(low, high))
            axes.minorticks_off()
        else:
            axes.xaxis.set_major_locator(MaxNLocator(2, steps=[1, 2, 5, 10]))
        axes.set_xlim(low, high)
        axes.set_ylim(0, HIGHEST_INCREASE)
        axes.set_xlabel(with_unit(item["symbol"], item["unit"]))
        panel(axes, "abcdefghijklmnopqrstuvwxyz"[index], item["verdict"], 40)
    grid[0].set_ylabel("rise of χ²")
    handles, labels = grid[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower right", ncols=5)
    drawn.suptitle(title, x=0.01, ha="left", fontsize=8)
    return drawn


def _curve(profile: dict[str, Any]) -> tuple[Array, Array]:
    """Return a smooth curve: the root of the increase, interpolated by monotone cubics (PCHIP).

    They do not overshoot (Fritsch & Carlson 1980); the root turns a parabola into straight lines.
    """
    from scipy.interpolate import PchipInterpolator

    # Rounding may have made neighbours equal.
    values, places = np.unique(np.array(profile["values"]), return_index=True)
    roots = np.sqrt(np.clip(np.array(profile["increases"])[places], 0.0, 4 * HIGHEST_INCREASE))
    dense = np.unique(np.concatenate([np.linspace(*pair, 6) for pair in pairwise(np.log(values))]))
    return np.exp(dense), PchipInterpolator(np.log(values), roots)(dense) ** 2


def _limits(axes: Axes, item: dict[str, Any]) -> None:
    low, high = item["low"], item["high"]
    values = item["profile"]["values"]
    if low is not None or high is not None:
        ends = [low or values[0], *(end for gap in item["excluded"] for end in gap)]
        ends.append(high or values[-1])
        for start, end in zip(ends[::2], ends[1::2], strict=True):
            axes.axvspan(start, end, color=SHADE, zorder=0, linewidth=0)
    for limit in (low, high):
        if limit is not None:
            axes.axvline(limit, color=BLUE, linewidth=0.7)
