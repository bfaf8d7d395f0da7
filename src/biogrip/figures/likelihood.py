"""Profile likelihoods of every quantity."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from string import ascii_letters
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.interpolate import PchipInterpolator

from biogrip.arrays import Array
from biogrip.digits import SUPERSCRIPTS, with_unit
from biogrip.figures import style
from biogrip.judging.likelihood import quantity_value
from biogrip.levels import CERTAIN

# End of the axis of profiles, and ratio of the ends above which that of values is logarithmic.
_HIGHEST_INCREASE, _LOGARITHMIC_FROM = 12.0, 5.0
# Share of the distances beside it up to which a point is too close to be drawn, too.
_APART = 0.1


def draw_profiles_of(
    judged: Mapping[str, Any],
    others: Sequence[Mapping[str, Any]] = (),
    title: str = "",
    truth_of: Mapping[str, float] | None = None,
    *,
    stacked: bool = False,
) -> Figure:
    """Draw profiles of verdicts, beside others that are expected and true parameters.

    Stacked, they are read on a telephone.
    """
    foreseen = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    quantities = judged["quantities"]
    drawn, grid = style.row_of_panels(len(quantities), 2.5, sharey=True, stacked=stacked)
    for index, (axes, item) in enumerate(zip(grid, quantities, strict=True)):
        if item["quantity"] in foreseen:
            curve = _curve(foreseen[item["quantity"]]["profile"])
            axes.plot(*curve, color=style.GREY, label="expected without noise")
        draw_profile(axes, item)
        for increase, look, label in (
            (judged["threshold"], "--", f"{100 * judged['confidence']:g} %: limits"),
            (judged["certainty"], ":", f"{100 * CERTAIN:g} %: needed to close a side"),
        ):
            if increase < _HIGHEST_INCREASE:
                axes.axhline(increase, color=style.TARGET, ls=look, linewidth=0.7, label=label)
        truth = quantity_value(item["quantity"], truth_of or {})
        if truth is not None:
            axes.axvline(truth, color=style.TARGET, linewidth=0.7, label="truth")
        style.panel(axes, ascii_letters[index], item["verdict"], 40)
    grid[0].set_ylabel("rise of χ²")
    lines = grid[0].get_legend_handles_labels()
    drawn.legend(*lines, loc="outside lower right", ncols=1 if stacked else 5)
    drawn.suptitle(style.literal(title), x=0.01, ha="left", fontsize=8)
    return drawn


def draw_profile(axes: Axes, item: Mapping[str, Any]) -> None:
    """Draw the profile of a quantity's verdict, with its limits."""
    axes.plot(*_curve(item["profile"]), color=style.FITTED, label="this trace")
    _shade_within_limits(axes, item)
    low, high = _profile_limits(item)
    if high / low > _LOGARITHMIC_FROM:
        axes.set_xscale("log")
        axes.set_xticks(*_decade_ticks(low, high))
        axes.minorticks_off()
    else:
        axes.xaxis.set_major_locator(MaxNLocator(2, steps=[1, 2, 5, 10]))
    axes.set(xlim=(low, high), ylim=(0, _HIGHEST_INCREASE))
    axes.set_xlabel(with_unit(item["symbol"], item["unit"]))


def _curve(profile: dict[str, Any]) -> tuple[Array, Array]:
    """Return a smooth curve: the root of the increase, interpolated by monotone cubics (PCHIP).

    They do not overshoot (Fritsch & Carlson 1980); the root turns a parabola into straight lines.
    """
    logs, increases = np.log(profile["values"]), np.array(profile["increases"])
    # Between close neighbours, as a limit beside a point, rounding is a step.
    gaps = np.concatenate(([np.inf], np.diff(logs), [np.inf]))
    apart = gaps[:-1] > _APART * np.minimum(np.append(np.inf, gaps[:-2]), gaps[1:])
    logs, roots = logs[apart], np.sqrt(np.clip(increases[apart], 0.0, 4 * _HIGHEST_INCREASE))
    dense = np.unique(np.concatenate([np.linspace(*pair, 6) for pair in pairwise(logs)]))
    return np.exp(dense), PchipInterpolator(logs, roots)(dense) ** 2


def _profile_limits(item: Mapping[str, Any]) -> tuple[float, float]:
    """Return limits of the x-axis: where the profile is inside the figure, plus a margin."""
    values, increases = (np.array(item["profile"][key]) for key in ("values", "increases"))
    inside = np.flatnonzero(increases < _HIGHEST_INCREASE)
    ends = [item["low"], item["high"], values[inside[0]], values[inside[-1]]]
    low, high = (float(end([x for x in ends if x is not None])) for end in (min, max))
    margin = max((high / low) ** 0.05, 1.0002)
    return max(float(values[0]), low / margin), min(float(values[-1]), high * margin)


def _decade_ticks(low: float, high: float) -> tuple[list[float], list[str]]:
    """Return at most three ticks of a logarithmic axis whose labels do not overlap."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    decades = list(range(first, last + 1))
    if len(decades) >= 2:
        step = -(-(len(decades) - 1) // 2)
        chosen = decades[::step]
        return [10.0**d for d in chosen], [f"10{str(d).translate(SUPERSCRIPTS)}" for d in chosen]
    steps = [m * 10.0**d for d in range(first - 1, last + 2) for m in (1, 2, 5)]
    ticks = [value for value in steps if low <= value <= high]
    # Labels of these values are wide, so keep two.
    inside = [ticks[0], ticks[-1]] if len(ticks) > 2 else ticks
    return inside, [f"{value:g}" for value in inside]


def _shade_within_limits(axes: Axes, item: Mapping[str, Any]) -> None:
    low, high = item["low"], item["high"]
    values = item["profile"]["values"]
    if low is not None or high is not None:
        ends = [low or values[0], *(end for gap in item["excluded"] for end in gap)]
        ends.append(high or values[-1])
        for start, end in zip(ends[::2], ends[1::2], strict=True):
            axes.axvspan(start, end, color=style.SHADE, zorder=0, linewidth=0)
    for limit in (low, high):
        if limit is not None:
            axes.axvline(limit, color=style.BLUE, linewidth=0.7)
