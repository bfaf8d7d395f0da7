"""A study at a glance: a fit, and identifications about the truth."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import biogrip_study.records.identifications as records
from biogrip.arrays import Array
from biogrip.figures import style
from biogrip.figures.fit import draw_traces
from biogrip.judging.likelihood import parameters_and_sum, quantity_value
from biogrip.judging.profiles import BOUNDED_ABOVE
from biogrip_study.config.study import Case, Study
from biogrip_study.figures import case_fit

# End of the axis of identified over target values.
_WORST = 1e3
_TITLE_LETTERS = 19
# Look of runs; points at the edge would make the layout leave them room.
_DOTS: dict[str, Any] = {
    "linestyle": "", "marker": "o", "markersize": 2.2, "markeredgewidth": 0, "alpha": 0.55,
    "clip_on": False, "in_layout": False,
}  # fmt: skip
_AT_EDGE = 3.0


def draw_overview(
    study: Study, identifications: list[Path], expected: list[Path], measurements: list[Path]
) -> Figure:
    """Draw a fit of each basin of the first case, and identified over target values of some."""
    cases = list(study.cases.values())
    drawn = style.figure(style.PAGE_IN, 3.0)
    axes = drawn.subplots(1, 1 + len(cases), width_ratios=[2] + [1.05] * len(cases))
    fits = case_fit.fits_of_basins(cases[0], identifications[0], measurements)
    factor, _ = draw_traces(axes[0], fits)
    fit = next(iter(fits.values()))
    axes[0].set_ylim(top=1.65 * factor * fit.measured.max())
    axes[0].set(xlim=(fit.time_s[0], fit.time_s[-1]), xlabel="time (s)")
    axes[0].legend(loc="upper right")
    style.panel(axes[0], "a", cases[0].title)
    files = zip(axes[1:], cases, identifications, expected, strict=True)
    for index, (scatter, case, path, judged) in enumerate(files):
        identified = records.read_identifications(path, case, study.shown_method.name)
        quantities = records.read_verdicts(judged)["quantities"]
        bounded = {item["quantity"] for item in quantities if item["verdict"] != BOUNDED_ABOVE}
        first = identified[identified["seed"] < case_fit.SHOWN_SEEDS]
        _draw_ratios(scatter, case, first, bounded)
        scatter.tick_params(labelleft=index == 0)
        style.panel(scatter, "bcd"[index], case.title, most_letters=_TITLE_LETTERS)
    axes[1].set_ylabel("identified / target")
    # Not every case is the paper's.
    entries = [scatter.get_legend_handles_labels() for scatter in axes[1:]]
    handles, labels = max(entries, key=lambda entry: len(entry[1]))
    few = len(identified) > case_fit.SHOWN_SEEDS
    title = case_fit.seeds_in_words(len(identified)) if few else None
    place: dict[str, Any] = {"loc": "outside lower right", "ncols": 5, "markerscale": 2.5}
    drawn.legend(handles, labels, title=title, **place)
    return drawn


def _draw_ratios(axes: Axes, case: Case, fits: pd.DataFrame, bounded: set[str]) -> None:
    """Draw identified over target values of what is determined or bounded below."""
    reached = records.near_noise(fits, case.study)
    looks = {
        f"fit {records.near_noise_words(case.study)}": (reached, style.FITTED),
        "other fits": (~reached, style.ALL_SEEDS),
    }
    for label, (_, color) in looks.items():
        axes.plot([], [], **_DOTS | {"color": color}, label=label)
    axes.plot([], [], "^", color=style.TARGET, markersize=1.6, label="beyond the axis")
    axes.axhline(1, color=style.TARGET, linewidth=0.8, label="truth")
    if case.published.identified:
        axes.plot([], [], color=style.PAPER, label="paper")
    ticks: list[str] = []
    found = records.values_by_quantity(fits, case.sample.model)
    for quantity in parameters_and_sum(case.sample.model):
        label, values = quantity.label, found[quantity.label]
        target = quantity_value(label, case.parameters)
        if not target or label not in bounded:
            continue
        x = len(ticks)
        ticks.append(quantity.symbol.replace(" ", ""))
        ratios = values.to_numpy(float) / target
        for which, color in reversed(looks.values()):
            _draw_runs(axes, x, ratios[which], color)
        if (paper := quantity_value(label, case.published.identified)) is not None:
            shown = np.clip(paper / target, 1 / _WORST, _WORST)
            axes.plot([x - 0.4, x + 0.4], [shown, shown], color=style.PAPER)
    axes.set(yscale="log", ylim=(1 / (2 * _WORST), 2 * _WORST))
    axes.set_xticks(range(len(ticks)), ticks)


def _draw_runs(axes: Axes, place: float, ratios: Array, color: str) -> None:
    """Draw ratios of runs, (n,), about a place, and triangles at the edge for those beyond."""
    # A fixed sideways scatter keeps points apart.
    sideways = place + 0.6 * ((np.arange(len(ratios)) * 0.618034) % 1 - 0.5)
    shown, look = np.clip(ratios, 1 / _WORST, _WORST), _DOTS | {"color": color}
    within = shown == ratios
    axes.plot(sideways[within], shown[within], **look)
    for marker, beyond in (("^", ratios > _WORST), ("v", ratios < 1 / _WORST)):
        edge = look | {"marker": marker, "markersize": _AT_EDGE}
        axes.plot(sideways[beyond], shown[beyond], **edge)
