"""Cells by group and unit: every cell a point, every unit a mean, and the mean of each group.

After the SuperPlots of Lord et al. (Journal of Cell Biology 219 (2020), e202001064), with the units
of a group side by side.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from biogrip.digits import plain, with_limits, with_unit
from biogrip.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, figure, literal
from biogrip.judging.cells import ABOVE, BELOW, KNOWN, Cell, Compared, no_longer_log
from biogrip.terminal import visible

ONE_COLUMN_IN = 85 / 25.4
"""Width of one column of a journal."""

_COLOURS, _SHAPES = (BLUE, ORANGE, GREEN, PURPLE, SKY, "#E69F00"), "osDPX*p"
_MARKS = {ABOVE: "^", KNOWN: "o", BELOW: "v"}
_PANEL_IN, _KEY_IN, _LONGEST = 2.3, 0.4, 14
_KEY = {
    "cell with limits, hollow if doubtful": "o",
    "cell, at most this": _MARKS[BELOW],
    "cell, at least this": _MARKS[ABOVE],
    "geometric mean with limits": "_",
}
# Most groups for which half a column has room, and most whose ratios have room for intervals.
_FEW_GROUPS, _MOST_GROUPS = 2, 4
# Most letters of groups' names that have room in half a column, and in a whole one.
_LETTERS = 18, 40
# Share of a group's place that its units have, and of a unit's that its points have.
_WIDE, _FILLED = 0.8, 0.7
# Steps of this share fill a unit evenly, however many its cells are.
_GOLDEN = 0.618034
_NORMAL, _BEYOND = 1.96, 1.5
_FAR, _MARGIN, _MOST_TICKS = 3.0, 1.15, 9
_SAID: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 6.5, "linespacing": 1.1}


def draw_cells(
    cells: Sequence[Cell],
    compared: Compared,
    units: Mapping[str, str],
    width_in: float,
    unit: str | None,
) -> Figure:
    """Draw a panel for each quantity that any cell determines, and a key of the marks.

    Units are those of the numbers, by quantity; the comparison has groups and their means. The last
    is the name of what was repeated, if anything was.
    """
    drawn_of = [name for name in units if any(cell.place(name) for cell in cells)]
    groups = list(dict.fromkeys(group for _, group in compared))
    narrow = ONE_COLUMN_IN / (1 if len(groups) > _FEW_GROUPS else 2)
    across = max(min(int(width_in / narrow + 1e-9), len(drawn_of)), 1)
    down = max(-(-len(drawn_of) // across), 1)
    drawn = figure(width_in, _PANEL_IN * down + _KEY_IN)
    places = drawn.subplots(down, across, squeeze=False).ravel()
    for axes in places[len(drawn_of) :]:
        axes.set_axis_off()
    for name, axes in zip(drawn_of, places, strict=False):
        _draw_quantity(axes, name, cells, compared, groups)
        axes.set_ylabel(literal(with_unit(name, units[name])))
    marks = _KEY | ({f"{literal(_short(unit))}, joined if the same": "s"} if unit else {})
    look: dict[str, Any] = {"color": GREY, "linestyle": "", "ms": 4}
    handles = [Line2D([], [], marker=mark, label=said, **look) for said, mark in marks.items()]
    drawn.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=6)
    return drawn


def _draw_quantity(
    axes: Axes, name: str, cells: Sequence[Cell], compared: Compared, groups: Sequence[str]
) -> None:
    ends: list[float] = []
    bars: list[tuple[float, list[float]]] = []
    said = False
    # A unit has one look, in whatever groups it is.
    numbers = {unit: n for n, unit in enumerate(dict.fromkeys(cell.unit for cell in cells))}
    means = defaultdict[str, list[tuple[float, float]]](list)
    for place, group in enumerate(groups):
        these = [cell for cell in cells if cell.group == group and not cell.rejects(name)]
        units = list(dict.fromkeys(cell.unit for cell in these))
        slot = _WIDE / max(len(units), 1)
        row = compared.get((name, group), {})
        for number, unit in enumerate(units):
            color = _COLOURS[numbers[unit] % len(_COLOURS)]
            middle = place + (number + 0.5) * slot - _WIDE / 2
            of_unit = [cell for cell in these if cell.unit == unit]
            ends += _draw_unit(axes, name, of_unit, middle, slot, color)
            if unit and unit in row["of_units"]:
                means[unit].append((middle, no_longer_log(row["of_units"][unit])))
        if "median" in row:
            levels = [row[it] for it in ("low", "median", "high") if it in row]
            beside = place + 0.46
            left = place - _WIDE / 2
            axes.hlines(row["median"], left, beside, color=BLACK, linewidth=0.8, zorder=2)
            bars.append((beside, levels))
        if "p" in row:
            ratio = with_limits(row["ratio"], row["ratio_low"], row["ratio_high"])
            ratio, _, limits = ratio.partition(" ")
            limits = f"\n{limits}\np =" if len(groups) <= _MOST_GROUPS else "\n"
            text, said = f"×{ratio}{limits} {row['p']:#.2g}", True
            axes.text(place, 1.0, text, transform=axes.get_xaxis_transform(), **_SAID)
    for unit, points in means.items():
        color, shape = (looks[numbers[unit] % len(looks)] for looks in (_COLOURS, _SHAPES))
        line: dict[str, Any] = {"color": color, "linewidth": 0.8, "zorder": 4}
        axes.plot(*np.transpose(points), marker=shape, mec=BLACK, mew=0.8, ms=6, **line)
    if said:
        text = f"ratio to\n{_short(groups[0])}" + (", p" if len(groups) > _MOST_GROUPS else "")
        axes.text(0, 1.0, text, transform=axes.get_xaxis_transform(), **_SAID)
    names = [literal(_short(group)) for group in groups]
    turned: dict[str, Any] = {}
    if len(groups) * max(map(len, names)) > _LETTERS[len(groups) > _FEW_GROUPS]:
        turned = {"rotation": 25, "ha": "right", "rotation_mode": "anchor"}
    axes.set(xlim=(-0.55, len(groups) - 0.4), xticks=range(len(groups)))
    axes.set_xticklabels(names, **turned)
    if ends:
        # Bars that reach far beyond all cells run out of the picture, dotted.
        low, high = min(ends) / _BEYOND, max(ends) * _BEYOND
        for x, levels in bars:
            style = ":" if levels[0] < low or levels[-1] > high else "-"
            axes.vlines(x, levels[0], levels[-1], color=BLACK, linestyle=style, zorder=5)
            axes.hlines(levels, x - 0.05, x + 0.05, color=BLACK, zorder=5)
            ends += np.clip(levels, low, high).tolist()
        _scale(axes, min(ends), max(ends))


def _draw_unit(
    axes: Axes, name: str, cells: Sequence[Cell], middle: float, slot: float, color: str
) -> list[float]:
    """Draw cells side by side around a place; doubtful ones hollow. Return their levels."""
    shown = [(cell, *place) for cell in cells if (place := cell.place(name))]
    shifts = _FILLED * slot * (np.arange(len(shown)) * _GOLDEN % 1 - 0.5)
    xs, levels = (middle + shifts).tolist(), [no_longer_log(value) for _, value, *_ in shown]
    for (cell, *_, side), x, level in zip(shown, xs, levels, strict=True):
        look: dict[str, Any] = {"ms": 3, "mew": 0.5, "alpha": 0.7, "zorder": 3, "color": color}
        axes.plot(x, level, _MARKS[side], mfc="white" if cell.doubtful else color, **look)
    low, high = ([no_longer_log(v + s * _NORMAL * e) for _, v, e, _ in shown] for s in (-1, 1))
    axes.vlines(xs, low, high, color=GREY, linewidth=0.4, zorder=1)
    return levels


def _scale(axes: Axes, low: float, high: float) -> None:
    """Set the axis of levels, logarithmic as ratios are, with ticks as numbers."""
    axes.set_yscale("log")
    subs = (1.0, 2.0, 3.0, 6.0) if high < 100 * low else (1.0,)
    decades, few = LogLocator(subs=subs, numticks=_MOST_TICKS), MaxNLocator(5, steps=[1, 2, 5, 10])
    axes.yaxis.set_major_locator(decades if high > _FAR * low else few)
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(low / _MARGIN, high * _MARGIN)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda level, _: plain(level, 4)))


def _short(text: str) -> str:
    text = visible(text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
