"""Profile likelihoods: what chi-squared says against other values of a quantity."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from biogrip.figures.style import BLUE, FITTED, GREY, PAGE_IN, SHADE, TARGET, figure, panel
from biogrip.identifiability.document import read_verdicts

_HIGHEST = 12.0
# A quotient beyond which an axis is logarithmic.
_WIDE = 5.0


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits.

    Parameters
    ----------
    settings
        ``title``, ``parameters`` (the true ones, empty if unknown).
    inputs
        Verdicts on its trace, JSON; and what its traces should tell, JSON, if
        the truth is known.
    """
    found, *others = (read_verdicts(path) for path in inputs)
    expected = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    quantities = found["quantities"]
    drawn = figure(PAGE_IN, 2.3)
    grid = drawn.subplots(1, len(quantities), sharey=True, squeeze=False)[0]
    for index, (axes, item) in enumerate(zip(grid, quantities, strict=True)):
        if item["quantity"] in expected:
            profile = expected[item["quantity"]]["profile"]
            label = "expected without noise"
            axes.plot(profile["values"], profile["rises"], color=GREY, label=label)
        profile = item["profile"]
        axes.plot(profile["values"], profile["rises"], color=FITTED, label="this trace")
        axes.axhline(found["threshold"], color=TARGET, linestyle="--", linewidth=0.7)
        _limits(axes, item)
        names = item["quantity"].split(" + ")
        if set(names) <= set(settings["parameters"]):
            truth = sum(settings["parameters"][name] for name in names)
            axes.axvline(truth, color=TARGET, linewidth=0.7, label="truth")
        low, high = _window(item)
        if high / low > _WIDE:
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(numticks=4))
            axes.minorticks_off()
        else:
            axes.xaxis.set_major_locator(MaxNLocator(3))
        axes.set_xlim(low, high)
        axes.set_ylim(0, _HIGHEST)
        axes.set_xlabel(f"{item['symbol']} ({item['unit']})")
        panel(axes, "abcdefghijklmnopqrstuvwxyz"[index], item["verdict"], 40)
    grid[0].set_ylabel("rise of χ²")
    handles, labels = grid[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower right", ncols=4)
    drawn.suptitle(settings["title"], x=0.01, ha="left", fontsize=8)
    return drawn


def _limits(axes: Axes, item: dict[str, Any]) -> None:
    low, high = item["low"], item["high"]
    values = item["profile"]["values"]
    if low is not None or high is not None:
        axes.axvspan(low or values[0], high or values[-1], color=SHADE, zorder=0, linewidth=0)
    for limit in (low, high):
        if limit is not None:
            axes.axvline(limit, color=BLUE, linewidth=0.7)


def _window(item: dict[str, Any]) -> tuple[float, float]:
    """Where the profile is below the top of the axis, and a little more."""
    values, rises = (np.array(item["profile"][key]) for key in ("values", "rises"))
    inside = np.flatnonzero(rises < _HIGHEST)
    first, last = max(inside[0] - 1, 0), min(inside[-1] + 1, len(values) - 1)
    low, high = float(values[inside[0]]), float(values[inside[-1]])
    # The next point of the grid may be far off.
    margin = max((high / low) ** 0.25, 1.002)
    return max(float(values[first]), low / margin), min(float(values[last]), high * margin)
