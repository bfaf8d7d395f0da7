"""Waterfall: how far above the global optimum each method ends, seed by seed."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from biogrip.figures.style import COLUMN_IN, GREY, METHOD_STYLES, TARGET, figure
from biogrip.identify.identifications import chi_square_rise, read_identifications
from biogrip.identify.methods import METHODS

_LOWEST = 1e-3


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw every method's rises of chi-squared over the lowest known, sorted.

    Parameters
    ----------
    settings
        ``title``, ``samples``, ``optimum_tolerance``, ``noise_floor_tolerance``.
    inputs
        Identifications of the case, CSV.
    """
    found = read_identifications(inputs[0])
    rise = np.maximum(chi_square_rise(found, settings["samples"]), _LOWEST)
    tolerance = settings["optimum_tolerance"]
    drawn = figure(COLUMN_IN, 3.0)
    axes = drawn.subplots()
    for method in found["method"].unique():
        mine = np.sort(rise[found["method"] == method])
        share = 100 * np.mean(mine <= tolerance)
        place = 100 * (np.arange(len(mine)) + 0.5) / len(mine)
        label = f"{METHODS[method].title}: {share:.0f} %"
        axes.plot(place, mine, label=label, **METHOD_STYLES[method])
    axes.axhline(tolerance, color=TARGET, linewidth=0.8, linestyle="--")
    floor = settings["samples"] * ((1 + settings["noise_floor_tolerance"]) ** 2 - 1)
    axes.axhline(floor, color=GREY, linewidth=0.8, linestyle=":")
    for height, text in ((tolerance, "global optimum"), (floor, "noise floor")):
        axes.annotate(
            text,
            (99.0, height),
            xytext=(0, 2),
            textcoords="offset points",
            fontsize=6.5,
            ha="right",
        )
    axes.set_yscale("log")
    axes.set_ylim(_LOWEST / 2, 5 * max(floor, float(rise.max())))
    ticks = [tick for tick in 10.0 ** np.arange(-3, 7) if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"≤{_LOWEST:g}", *(f"{tick:g}" for tick in ticks[1:])])
    axes.minorticks_off()
    axes.set_xlim(0, 100)
    axes.set_xlabel("seeds, sorted (%)")
    axes.set_ylabel("Δχ² over the lowest known")
    axes.set_title(f"{settings['title']}: share at the global optimum")
    drawn.legend(loc="outside lower center", ncols=2)
    return drawn
