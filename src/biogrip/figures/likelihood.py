"""Profile likelihoods of every quantity, and chi-squared over two that trade: a valley."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from string import ascii_letters
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.interpolate import PchipInterpolator

from biogrip.arrays import Array
from biogrip.digits import SUPERSCRIPTS, with_unit
from biogrip.figures import style
from biogrip.figures.fit import first_seeds, seeds_in_words
from biogrip.levels import CERTAIN
from biogrip.records.identifications import read_identifications, read_verdicts
from biogrip.study.study import Case
from biogrip.tables.cases import target_of

# End of the axis of profiles, and ratio of the ends above which that of values is logarithmic.
_HIGHEST_INCREASE, _WIDE = 12.0, 5.0


def draw_profiles(case: Case, verdicts: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits."""
    others = [read_verdicts(path) for path in expected]
    return draw_profiles_of(read_verdicts(verdicts), others, case.title, case.parameters)


def draw_profiles_of(
    found: Mapping[str, Any],
    others: Sequence[Mapping[str, Any]] = (),
    title: str = "",
    truth_of: Mapping[str, float] | None = None,
) -> Figure:
    """Draw profiles of verdicts, beside others that are expected and true parameters."""
    foreseen = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    quantities = found["quantities"]
    drawn, grid = style.row_of_panels(len(quantities), 2.5, sharey=True)
    for index, (axes, item) in enumerate(zip(grid, quantities, strict=True)):
        if item["quantity"] in foreseen:
            curve = _curve(foreseen[item["quantity"]]["profile"])
            axes.plot(*curve, color=style.GREY, label="expected without noise")
        draw_profile(axes, item)
        for increase, look, label in (
            (found["threshold"], "--", f"{100 * found['confidence']:g} %"),
            (found["certainty"], ":", f"{100 * CERTAIN:g} %, to close a side"),
        ):
            axes.axhline(increase, color=style.TARGET, linestyle=look, linewidth=0.7, label=label)
        truth = target_of(item["quantity"], truth_of or {})
        if truth is not None:
            axes.axvline(truth, color=style.TARGET, linewidth=0.7, label="truth")
        style.panel(axes, ascii_letters[index], item["verdict"], 40)
    grid[0].set_ylabel("rise of χ²")
    drawn.legend(*grid[0].get_legend_handles_labels(), loc="outside lower right", ncols=5)
    drawn.suptitle(style.literal(title), x=0.01, ha="left", fontsize=8)
    return drawn


def draw_profile(axes: Axes, item: Mapping[str, Any]) -> None:
    """Draw the profile of a quantity's verdict, with its limits."""
    axes.plot(*_curve(item["profile"]), color=style.FITTED, label="this trace")
    _limits(axes, item)
    low, high = _profile_limits(item)
    if high / low > _WIDE:
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
    # Rounding may have made neighbours equal.
    values, places = np.unique(np.array(profile["values"]), return_index=True)
    roots = np.sqrt(np.clip(np.array(profile["increases"])[places], 0.0, 4 * _HIGHEST_INCREASE))
    dense = np.unique(np.concatenate([np.linspace(*pair, 6) for pair in pairwise(np.log(values))]))
    return np.exp(dense), PchipInterpolator(np.log(values), roots)(dense) ** 2


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
    found = [value for value in steps if low <= value <= high]
    # Labels of these values are wide, so keep two.
    inside = [found[0], found[-1]] if len(found) > 2 else found
    return inside, [f"{value:g}" for value in inside]


def _limits(axes: Axes, item: Mapping[str, Any]) -> None:
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


_LEVELS = [0.0, 1.0, 3.84, 10.83, 30.0, 100.0, 300.0, 1000.0]
# Increase of chi^2 up to which axes show the valley; margin as a share of what they show; largest
# end and least length of an axis as multiples of the sum c + c_p.
_DEEP, _AROUND, _FARTHEST, _LEAST = 10.83, 0.12, 1.15, 0.02

# Not in layout: it would reserve room for labels of points.
_POINTS: dict[str, Any] = {"linestyle": "", "clip_on": False, "in_layout": False}
_FITS = _POINTS | {
    "color": style.FITTED, "marker": "o", "markersize": 2.5, "markeredgewidth": 0, "alpha": 0.8
}  # fmt: skip
# Open markers below the truth, since both may coincide.
_THE_PAPERS = _POINTS | {
    "color": style.PAPER, "marker": "D", "markersize": 6, "markerfacecolor": "none",
    "markeredgewidth": 1.4, "zorder": 4,
}  # fmt: skip
_TRUE = _POINTS | {
    "color": style.TARGET, "marker": "*", "markersize": 7, "markeredgecolor": "white",
    "markeredgewidth": 0.6, "zorder": 5,
}  # fmt: skip


def draw_valley(case: Case, verdicts: Path, identifications: Path) -> Figure:
    """Draw the increase of chi-squared over the two exchangeable dampers of a case."""
    found = read_verdicts(verdicts)
    valley = found["valley"]
    x, y = valley["x"], valley["y"]
    identified = read_identifications(identifications, case, case.study.fitting_method.name)
    drawn = style.figure(style.COLUMN_IN, 3.1)
    axes = drawn.subplots()
    colours = colormaps["cividis_r"](np.linspace(0, 0.95, len(_LEVELS)))
    shown = []
    for grid in valley["grids"]:
        # The root of the increase is nearly linear, so interpolate that.
        roots = np.sqrt(np.maximum(np.array(grid["increases"], dtype=float), 0.0))
        values, levels = (grid["x_values"], grid["y_values"]), np.sqrt(_LEVELS)
        filled = axes.contourf(*values, roots, levels, colors=colours, extend="max")
        shown += [path.vertices for path in filled.get_paths()[: _LEVELS.index(_DEEP)]]
    total = sum(valley["best"])
    label = f"{x['symbol']} + {y['symbol']} = {total:.3g} {x['unit']}"
    axes.plot(
        [0, total], [total, 0], color=style.TARGET, linewidth=0.8, linestyle="--", label=label
    )
    columns = [f"{item['name']}_Ns_per_m" for item in (x, y)]
    label = f"{case.study.fitting_method.title}, {seeds_in_words(len(identified))}"
    marked = [(first_seeds(identified)[columns].to_numpy(float), _FITS, label)]
    marked += [
        (np.array([[place[x["name"]], place[y["name"]]]]), look, name)
        for place, look, name in (
            (case.published.identified, _THE_PAPERS, "paper"),
            (case.parameters, _TRUE, "truth"),
        )
        if {x["name"], y["name"]} <= set(place)
    ]
    places = [np.array([valley["best"]]), *(points for points, *_ in marked)]
    low, high = _window(np.concatenate([*shown, *places]), total)
    for points, look, name in marked:
        labels = (name, "beyond the axis")
        style.points_within(axes, points, (0, 0), high, look, edge_size=4.5, labels=labels)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), title=case.title)
    axes.set_xlabel(with_unit(x["symbol"], x["unit"]))
    axes.set_ylabel(with_unit(y["symbol"], y["unit"]))
    axes.set_box_aspect(1)
    drawn.legend(loc="outside lower center", ncols=2)
    bar = drawn.colorbar(filled, ax=axes, ticks=list(np.sqrt(_LEVELS)))
    bar.ax.set_yticklabels([f"{level:g}" for level in _LEVELS])
    bar.set_label("rise of χ²")
    return drawn


def _window(places: Array, total: float) -> tuple[Array, Array]:
    """Return lower and upper ends of both axes around places, (n, 2), within bounds."""
    places = np.minimum(places, _FARTHEST * total)
    low, high = places.min(axis=0), places.max(axis=0)
    around = np.maximum(_AROUND * (high - low), (_LEAST * total - (high - low)) / 2)
    return np.maximum(low - around, 0.0), np.minimum(high + around, _FARTHEST * total)
