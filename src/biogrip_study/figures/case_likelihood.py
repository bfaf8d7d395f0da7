"""Profile likelihoods of a case, and chi-squared over two quantities that trade: a valley."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.figures.likelihood import draw_profiles_of
from biogrip_study.config.study import Case
from biogrip_study.figures.case_fit import first_seeds, seeds_in_words
from biogrip_study.records.identifications import read_identifications, read_verdicts


def draw_profiles(case: Case, verdicts: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits."""
    others = [read_verdicts(path) for path in expected]
    return draw_profiles_of(read_verdicts(verdicts), others, case.title, case.parameters)


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
