"""Heat maps of a sweep: share of seeds in the true basin, and their errors over the bound."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.style import PAGE_IN, figure, panel
from biogrip.study.study import Study
from biogrip.study.sweeps import SweepBlock
from biogrip.tables.sweeps import axis_title, headlines_of, read_points

_MOST_CASES = 3
_CELL_IN = 0.24
_TALLEST_IN = 2.4
# Smallest cell that holds two lines of text.
_LEGIBLE_IN = (0.26, 0.2)
_SHARE = Normalize(0, 100)
_RATIO = LogNorm(0.5, 100)
_RATIO_TICKS = (0.5, 1, 2, 5, 10, 20, 50, 100)
_WITHOUT_BOUND = "#dddddd"


def draw_robustness(study: Study, name: str, points: Path) -> Figure:
    """Draw shares in the true basin, and errors of the best and the worst determined quantity.

    Numbers in cells are for the first method; brackets hold the share of the second method, and
    the bound.
    """
    sweep, methods = study.config.sweeps[name], study.identifiers
    cases = list(sweep.cases)[:_MOST_CASES]
    rows = len(sweep.rows.levels)
    height = min(max(_CELL_IN * rows, 0.9), _TALLEST_IN)
    drawn = figure(PAGE_IN, 3 * (height + 0.25) + 0.9)
    grid = drawn.subplots(3, len(cases), squeeze=False, sharex=True, sharey=True)
    for index, case in enumerate(cases):
        found = read_points(points, name, case)
        panel(grid[0, index], "abc"[index], study.cases[case].title, most_letters=24)
        first, *others = (found[found["method"] == method] for method in list(methods)[:2])
        shares = [100 * _grid(sweep, each, "basin_share") for each in (first, *others)]
        _heat_map(grid[0, index], sweep, shares[0], _SHARE, "cividis")
        _write(grid[0, index], shares, _SHARE(shares[0]), "cividis", height / rows)
        chosen = headlines_of(found)
        for axes, quantity in zip(grid[1:, index], chosen, strict=False):
            axes.set_title(f"{_symbol(quantity)}: error there (bound) in %", fontsize=7.5)
            own = first[first["quantity"] == quantity]
            error, bound = (_grid(sweep, own, f"{it}_percent") for it in ("basin_error", "bound"))
            # Clip, since an error of zero has no logarithm.
            ratio = np.clip(error / bound, _RATIO.vmin, _RATIO.vmax)
            _heat_map(axes, sweep, ratio, _RATIO, "cividis_r")
            _write(axes, [error, bound], _RATIO(ratio), "cividis_r", height / rows)
        for axes in grid[1 + len(chosen) :, index]:
            axes.set_axis_off()
            words = "nothing else is determined\nat half of the points"
            axes.text(0.5, 0.5, words, ha="center", transform=axes.transAxes)
    drawn.supylabel(axis_title(study, sweep.rows), fontsize=8)
    drawn.supxlabel(axis_title(study, sweep.columns), fontsize=8)
    title, *titles = (method.title for method in methods.values())
    bar = drawn.colorbar(ScalarMappable(_SHARE, "cividis"), ax=list(grid[0]), pad=0.01)
    lines = ["seeds in the true basin (%)", title, *(f"({other})" for other in titles[:1])]
    bar.set_label("\n".join(lines), fontsize=7)
    bar = drawn.colorbar(
        ScalarMappable(_RATIO, "cividis_r"), ax=list(grid[1:].flat), pad=0.01, extend="both"
    )
    bar.set_ticks(_RATIO_TICKS, labels=[f"{tick:g}" for tick in _RATIO_TICKS])
    bar.set_label(f"median error there / bound\n{title}", fontsize=7)
    drawn.suptitle(sweep.title or name, fontsize=8, x=0.01, ha="left")
    return drawn


def _grid(sweep: SweepBlock, points: pd.DataFrame, column: str) -> Array:
    """Return a column's values as a grid, (n_rows, n_columns)."""
    wide = points.pivot_table(index="row", columns="column", values=column, dropna=False)
    rows, columns = ([level.shown for level in axis.levels] for axis in (sweep.rows, sweep.columns))
    return wide.reindex(index=rows, columns=columns).to_numpy(float)


def _heat_map(axes: Axes, sweep: SweepBlock, values: Array, norm: Normalize, colours: str) -> None:
    axes.set_facecolor(_WITHOUT_BOUND)
    axes.pcolormesh(values, norm=norm, cmap=colours, edgecolors="white", linewidth=0.5)
    for axis, set_ticks in ((sweep.rows, axes.set_yticks), (sweep.columns, axes.set_xticks)):
        shown = [level.shown.replace(", ", ",\n") for level in axis.levels]
        set_ticks(np.arange(len(shown)) + 0.5, shown)
    axes.tick_params(length=0, labelsize=6.5)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _write(axes: Axes, numbers: list[Array], colour: Array, colours: str, height_in: float) -> None:
    """Write a number into every cell, and a second one in brackets below it."""
    columns = numbers[0].shape[1]
    if PAGE_IN / (_MOST_CASES + 1) / columns < _LEGIBLE_IN[0] or height_in < _LEGIBLE_IN[1]:
        return
    dark = colours == "cividis"
    for (row, column), share in np.ndenumerate(colour):
        light = share < 0.5 if dark else share > 0.5
        texts = [_short(float(grid[row, column])) for grid in numbers]
        lines = [texts[0], *(f"({text})" for text in texts[1:] if text)]
        color = "white" if light and np.isfinite(share) else "black"
        style: dict[str, Any] = {"color": color, "fontsize": 5.5, "linespacing": 0.95}
        place = column + 0.5, row + 0.5
        axes.text(*place, "\n".join(lines), ha="center", va="center", **style)


def _short(number: float) -> str:
    if not np.isfinite(number):
        return ""
    if 0 < number < 0.01:
        return "<0.01"
    if number >= 10_000:
        return f"{number:.0e}".replace("e+0", "e")
    return f"{number:.0f}" if number >= 10 else f"{number:.{1 if number < 0.1 else 2}g}"


def _symbol(quantity: str) -> str:
    """Return a quantity's label as mathtext."""
    return "$" + re.sub(r"_(\w+)", r"_{\1}", quantity) + "$"
