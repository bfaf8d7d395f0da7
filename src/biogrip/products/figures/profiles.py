"""Profile likelihoods: what chi-squared says against other values of a quantity."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import BLUE, FITTED, GREY, PAGE_IN, SHADE, TARGET, figure, panel
from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.product import JUDGEMENT, the
from biogrip.products.stages.expected import verdicts_expected
from biogrip.study.study import Case, Study

_HIGHEST = 12.0
# A quotient beyond which an axis is logarithmic.
_WIDE = 5.0


@dataclass(frozen=True)
class Settings:
    """A case in print, and its true parameters, none if they are unknown."""

    title: str
    parameters: Mapping[str, float]


def settings(study: Study, case: Case) -> Settings:
    """Choose what the profiles of a case depend on."""
    return Settings(case.title, case.parameters)


def draw(settings: Settings, measured: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits.

    Parameters
    ----------
    settings
        The case.
    measured
        Verdicts on its trace, JSON.
    expected
        What its traces should tell, JSON, if the truth is known.
    """
    found, others = read_verdicts(measured), [read_verdicts(path) for path in expected]
    foreseen = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    quantities = found["quantities"]
    drawn = figure(PAGE_IN, 2.3)
    grid = drawn.subplots(1, len(quantities), sharey=True, squeeze=False)[0]
    for index, (axes, item) in enumerate(zip(grid, quantities, strict=True)):
        if item["quantity"] in foreseen:
            profile = foreseen[item["quantity"]]["profile"]
            label = "expected without noise"
            axes.plot(profile["values"], profile["rises"], color=GREY, label=label)
        profile = item["profile"]
        axes.plot(profile["values"], profile["rises"], color=FITTED, label="this trace")
        axes.axhline(found["threshold"], color=TARGET, linestyle="--", linewidth=0.7)
        _limits(axes, item)
        names = item["quantity"].split(" + ")
        if set(names) <= set(settings.parameters):
            truth = sum(settings.parameters[name] for name in names)
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
    drawn.suptitle(settings.title, x=0.01, ha="left", fontsize=8)
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


PROFILES = drawing(
    draw,
    name="profiles",
    caption="Profile likelihoods of one seed, and without noise (grey); shaded: 95 % interval; "
    "dashed: its threshold.",
    settings=settings,
    reads={"measured": the(PATH), "expected": verdicts_expected()},
    cases=lambda study: study.cases,
    sheet="case_figures",
    weight=JUDGEMENT,
)
