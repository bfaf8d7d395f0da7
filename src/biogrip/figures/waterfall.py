"""Waterfall plot: sorted increase of chi-squared over the global optimum, by method."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from biogrip.figures.style import COLUMN_IN, TARGET, figure, line_of
from biogrip.fit.methods import chi_square_increase, near_noise_words
from biogrip.records.identifications import read_identifications
from biogrip.study.study import Case

_LOWEST = 1e-3


def draw(case: Case, identifications: Path) -> Figure:
    """Draw the sorted increases of chi-squared over the lowest known, for every method."""
    found = read_identifications(identifications)
    increase = np.maximum(chi_square_increase(found, case.samples), _LOWEST)
    tolerance = case.study.optimum_tolerance
    drawn = figure(COLUMN_IN, 3.15)
    axes = drawn.subplots()
    methods = found["method"].unique()
    curves = []
    # Where curves coincide each is seen beside the thinner ones on top of it.
    for name, width in zip(methods, np.linspace(3.2, 1.0, len(methods)), strict=True):
        method = case.study.identifiers[name]
        mine = np.sort(increase[found["method"] == name])
        share = 100 * np.mean(mine <= tolerance)
        place = 100 * (np.arange(len(mine)) + 0.5) / len(mine)
        label = f"{method.title}: {share:.0f} %"
        curves += axes.plot(place, mine, label=label, linewidth=width, **line_of(method))
    near = case.samples * ((1 + case.study.near_noise_tolerance) ** 2 - 1)
    # Limits are named in the legend, since a curve may cover any place along them.
    words = near_noise_words(case.study.near_noise_tolerance)
    line: dict[str, Any] = {"color": TARGET, "linewidth": 0.8}
    limits = [
        axes.axhline(tolerance, linestyle="--", label="global optimum", **line),
        axes.axhline(near, linestyle=":", label=words, **line),
    ]
    axes.set(yscale="log", ylim=(_LOWEST / 2, 5 * max(near, float(increase.max()))))
    ticks = [tick for tick in 10.0 ** np.arange(-3, 7) if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"≤{_LOWEST:g}", *(f"{tick:g}" for tick in ticks[1:])])
    axes.minorticks_off()
    axes.set_xlim(0, 100)
    axes.set_xlabel("seeds, sorted (%)")
    axes.set_ylabel("Δχ² over the lowest known")
    axes.set_title(f"{case.title}: share at the global optimum")
    # Each legend column ends with a limit; a third column would be too wide.
    half = -(-len(curves) // 2)
    handles = [*curves[:half], limits[0], *curves[half:], limits[1]]
    drawn.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.0)
    return drawn
