"""Overviews of a study: fits and identifications about the truth; and its answer at a glance."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from biogrip.digits import with_unit
from biogrip.figures.fit import draw_traces, judged_fit
from biogrip.figures.likelihood import draw_profile
from biogrip.figures.results import (
    SHOWN_SEEDS,
    Fit,
    first_seeds,
    fits_of_basins,
    seeds_in_words,
)
from biogrip.figures.style import (
    ALL_SEEDS,
    BLACK,
    BLUE,
    COLUMN_IN,
    FITTED,
    ORANGE,
    PAGE_IN,
    PAPER,
    TARGET,
    figure,
    panel,
    points_within,
)
from biogrip.judging.verdicts import BOUNDED_ABOVE
from biogrip.records.identifications import read_identifications, read_verdicts
from biogrip.records.success import near_noise, near_noise_words
from biogrip.study.study import Case, Study

# Ends of the axes of identified over target values, of parameters in decades and of sums.
_WORST, _SUM = 1e3, 0.1
_TITLE_LETTERS = 19
_MOST_CASES = 3
_DOTS: dict[str, Any] = {
    "linestyle": "", "marker": "o", "markersize": 2.2, "markeredgewidth": 0, "alpha": 0.55
}  # fmt: skip


def shown_cases(study: Study) -> list[str]:
    """Return names of the first simulated cases, as many as fit."""
    return study.simulated[:_MOST_CASES]


def draw_overview(
    study: Study,
    identifications: list[Path],
    expected: list[Path],
    measurements: list[Path],
    calibrated: list[Path],
) -> Figure:
    """Draw a fit of each basin of the first case, and identified over target values of some."""
    cases = list(study.cases.values())
    drawn = figure(PAGE_IN, 3.0)
    axes = drawn.subplots(1, 1 + len(cases), width_ratios=[2] + [1.05] * len(cases))
    fits = fits_of_basins(cases[0], identifications[0], measurements, calibrated)
    _fits(axes[0], cases[0], fits)
    files = zip(axes[1:], cases, identifications, expected, strict=True)
    for index, (scatter, case, path, judged) in enumerate(files):
        found = read_identifications(path, case, study.shown)
        quantities = read_verdicts(judged)["quantities"]
        bounded = {it["quantity"] for it in quantities if it["verdict"] != BOUNDED_ABOVE}
        _scatter(scatter, case, first_seeds(found), study.near_noise_tolerance, bounded)
        scatter.set_yticks([1e-3, 1e-2, 0.1, 1, 10, 100, 1e3], [""] * 7 if index else None)
        panel(scatter, "bcd"[index], case.title, most_letters=_TITLE_LETTERS)
    axes[1].set_ylabel("identified / target")
    legend: dict[str, Any] = {}
    for scatter in axes[1:]:
        handles, labels = scatter.get_legend_handles_labels()
        legend |= dict(zip(labels, handles, strict=True))
    drawn.legend(
        legend.values(),
        legend.keys(),
        loc="outside lower right",
        ncols=5,
        markerscale=2.5,
        title=seeds_in_words(len(found)) if len(found) > SHOWN_SEEDS else None,
    )
    return drawn


def _fits(axes: Axes, case: Case, fits: Mapping[str, Fit]) -> None:
    factor, _ = draw_traces(axes, fits)
    fit = next(iter(fits.values()))
    axes.set_ylim(top=1.65 * factor * fit.measured.max())
    axes.set(xlim=(fit.time_s[0], fit.time_s[-1]), xlabel="time (s)")
    axes.legend(loc="upper right")
    panel(axes, "a", case.title)


def _scatter(
    axes: Axes, case: Case, found: pd.DataFrame, tolerance: float, bounded: set[str]
) -> None:
    """Draw identified over target values of the quantities that are bounded."""
    reached = near_noise(found, tolerance)
    identified = case.published.identified
    ticks: list[str] = []
    # Sums are told so much better that on an axis of decades they are a line.
    sums = axes.twinx()
    sums.set(ylim=(1 - _SUM, 1 + _SUM))
    for group in case.sample.model.quantities:
        names = [parameter.name for parameter in group]
        target = sum(case.parameters[name] for name in names)
        if target <= 0 or " + ".join(names) not in bounded:
            continue
        x = len(ticks)
        ticks.append("+".join(parameter.symbol for parameter in group))
        ratio = found[[parameter.column for parameter in group]].sum(axis=1).to_numpy(float)
        place = x + 0.5 * ((np.arange(len(ratio)) * 0.618034) % 1 - 0.5)
        points = np.column_stack([place, ratio / target])
        own, ends = (
            (axes, (1 / _WORST, _WORST)) if len(group) == 1 else (sums, (1 - _SUM, 1 + _SUM))
        )
        for which, color, label in (
            (~reached, ALL_SEEDS, "other fits"),
            (reached, FITTED, f"fit {near_noise_words(tolerance)}"),
        ):
            style, labels = _DOTS | {"color": color}, (label, "")
            low, high = ((sign * np.inf, end) for sign, end in zip((-1, 1), ends, strict=True))
            points_within(own, points[which], low, high, style, edge_size=3.5, labels=labels)
        if set(names) <= set(identified):
            paper = sum(identified[name] for name in names) / target
            shown = float(np.clip(paper, *ends))
            own.plot([x - 0.4, x + 0.4], [shown, shown], color=PAPER, label="paper")
    axes.axhline(1, color=TARGET, linewidth=0.8, label="truth")
    axes.set_yscale("log")
    axes.plot([], [], "^", color=TARGET, markersize=1.6, label="beyond the axis")
    axes.set_ylim(1 / (2 * _WORST), 2 * _WORST)
    axes.set_xticks(range(len(ticks)), ticks)
    sums.spines["right"].set_visible(True)
    sums.set_yticks([1 - _SUM, 1, 1 + _SUM], [f"{1 - _SUM:g}", "1", f"{1 + _SUM:g}"])
    if len(ticks) > 1:
        axes.axvline(len(ticks) - 1.5, color=TARGET, linewidth=0.5)


def draw_answer(case: Case, verdicts: Path, measurements: Path, calibrated: list[Path]) -> Figure:
    """Draw a gripper, the judged trace of a case, and what it tells of two exchangeable dampers."""
    found = read_verdicts(verdicts)
    items = {item["quantity"]: item for item in found["quantities"]}
    drawn = figure(COLUMN_IN, 3.4)
    (device, trace), profiles = drawn.subplots(2, 2)
    _device(device)
    panel(device, "1", "two arms squeeze")
    fit = judged_fit(case, found, measurements, calibrated)
    factor, unit = draw_traces(trace, {"fit": fit})
    trace.set_ylim(top=1.45 * factor * fit.measured.max())
    trace.set(xlabel="time (s)", ylabel=with_unit("rotation", unit))
    handles, _ = trace.get_legend_handles_labels()
    trace.legend(handles[::2], ["trace", "fit"], loc="upper right", ncols=2, columnspacing=1)
    panel(trace, "2", "one of them turns")
    names = [found["valley"][axis]["name"] for axis in "xy"]
    for number, axes, name in zip("34", profiles, (" + ".join(names), names[1]), strict=True):
        draw_profile(axes, items[name])
        axes.axhline(found["threshold"], color=BLACK, linestyle="--", linewidth=0.7)
        place = (0.02, found["threshold"] + 0.2, f"{100 * found['confidence']:g} %")
        axes.text(*place, transform=axes.get_yaxis_transform(), fontsize=7)
        panel(axes, number, f"{items[name]['symbol']}: {items[name]['verdict']}")
    profiles[0].set_ylabel("rise of χ²")
    return drawn


def _device(axes: Axes) -> None:
    """Draw two arms with a sample between their tips, not to scale."""
    axes.add_patch(Circle((0, 3.0), 0.34, color=ORANGE))
    for side in (-1, 1):
        axes.plot([side * 1.2, side * 0.32], [0, 3.1], color=BLUE, linewidth=4)
        axes.plot(side * 1.2, 0, "o", color="white", markeredgecolor=BLACK, markersize=6)
        arrow = {"arrowstyle": "->", "lw": 1.0, "color": BLACK}
        axes.annotate("", (side * 0.65, 1.5), (side * 1.5, 1.5), arrowprops=arrow)
    axes.annotate("torque", (0, 1.5), ha="center", va="center", fontsize=7)
    axes.set(xlim=(-1.8, 1.8), ylim=(-0.3, 3.5), aspect="equal")
    axes.set_axis_off()
