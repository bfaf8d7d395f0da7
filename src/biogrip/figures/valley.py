"""Chi-squared over c and c_p, whose valley shows that only their sum is determined."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.results import first_seeds, seeds_in_words
from biogrip.figures.style import COLUMN_IN, FITTED, PAPER, TARGET, figure
from biogrip.records.identifications import read_identifications, read_verdicts
from biogrip.study.study import Case

_LEVELS = [0.0, 1.0, 3.84, 10.83, 30.0, 100.0, 300.0, 1000.0]
# Increase of chi^2 up to which axes show the valley; margin as a share of what they show; largest
# end and least length of an axis as multiples of the sum c + c_p.
_DEEP, _AROUND, _FARTHEST, _LEAST = 10.83, 0.12, 1.15, 0.02

# Not in layout: it would reserve room for labels of points.
_POINTS: dict[str, Any] = {"linestyle": "", "clip_on": False, "in_layout": False}
_FITS = _POINTS | {
    "color": FITTED, "marker": "o", "markersize": 2.5, "markeredgewidth": 0, "alpha": 0.8
}  # fmt: skip
# Open markers below the truth, since both may coincide.
_THE_PAPERS = _POINTS | {
    "color": PAPER, "marker": "D", "markersize": 6, "markerfacecolor": "none",
    "markeredgewidth": 1.4, "zorder": 4,
}  # fmt: skip
_TRUE = _POINTS | {
    "color": TARGET, "marker": "*", "markersize": 7, "markeredgecolor": "white",
    "markeredgewidth": 0.6, "zorder": 5,
}  # fmt: skip


def draw(case: Case, measured: Path, identifications: Path) -> Figure:
    """Draw the increase of chi-squared over the two exchangeable dampers of a case."""
    found = read_verdicts(measured)
    valley = found["valley"]
    x, y = valley["x"], valley["y"]
    identified = read_identifications(identifications, case.study.fitting_method.name)
    drawn = figure(COLUMN_IN, 3.1)
    axes = drawn.subplots()
    colours = colormaps["cividis_r"](np.linspace(0, 0.95, len(_LEVELS)))
    shown = []
    for grid in valley["grids"]:
        # The root of the increase is nearly linear, so interpolate that.
        roots = np.sqrt(np.maximum(np.array(grid["increases"], dtype=float), 0.0))
        filled = axes.contourf(
            grid["x_values"],
            grid["y_values"],
            roots,
            np.sqrt(_LEVELS),
            colors=colours,
            extend="max",
        )
        shown += [path.vertices for path in filled.get_paths()[: _LEVELS.index(_DEEP)]]
    total = sum(valley["best"])
    label = f"{x['symbol']} + {y['symbol']} = {total:.3g} {x['unit']}"
    axes.plot([0, total], [total, 0], color=TARGET, linewidth=0.8, linestyle="--", label=label)
    drawn_seeds = seeds_in_words(len(identified))
    columns = [f"{item['name']}_Ns_per_m" for item in (x, y)]
    points = first_seeds(identified)[columns].to_numpy(float)
    label = f"{case.study.fitting_method.title}, {drawn_seeds}"
    known = [
        (np.array([[place[x["name"]], place[y["name"]]]]), style, name)
        for place, style, name in (
            (case.published.identified, _THE_PAPERS, "paper"),
            (case.parameters, _TRUE, "truth"),
        )
        if {x["name"], y["name"]} <= set(place)
    ]
    places = [np.array([valley["best"]]), points, *(place for place, *_ in known)]
    low, high = _window(np.concatenate([*shown, *places]), total)
    _points(axes, points, high, _FITS, label)
    for place, style, name in known:
        _points(axes, place, high, style, name)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel(f"{x['symbol']} ({x['unit']})")
    axes.set_ylabel(f"{y['symbol']} ({y['unit']})")
    axes.set_title(case.title)
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


def _points(axes: Axes, points: Array, ends: Array, style: dict[str, Any], label: str) -> None:
    """Draw points, with triangles at the edge for points beyond the axes."""
    right, above = (points > ends).T
    inside = ~right & ~above
    axes.plot(*points[inside].T, **style, label=label)
    for marker, outside in ((">", right), ("^", above & ~right)):
        if np.any(outside):
            at = np.minimum(points[outside], ends).T
            beyond = style | {"marker": marker, "markersize": 4.5}
            axes.plot(*at, **beyond, label="beyond the axis")
