"""Figure 8: the best misfit over generations."""

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from biogrip.figures.results import read_history, seeds_in_words, typical_in_words
from biogrip.figures.style import ALL_SEEDS, COLUMN_IN, FITTED, TARGET, figure
from biogrip.fit.methods import near_noise, near_noise_words, typical
from biogrip.records.identifications import read_identifications
from biogrip.study.study import Case

_TICKS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)


def draw(case: Case, identifications: Path, histories: Path) -> Figure:
    """Draw each seed's excess of the misfit over its noise, highlighting the typical seed."""
    found = read_identifications(identifications, case.study.shown_method.name)
    noise = found.set_index("seed")["noise_rms"]
    noisy = bool((noise > 0).all())
    unit = noise if noisy else pd.Series(found["misfit"].min(), index=noise.index)
    shown = int(typical(found)["seed"])
    history = read_history(histories, case.study.shown_method.name, shown)
    reached = near_noise(found, case.study.near_noise_tolerance)
    drawn = figure(COLUMN_IN, 2.5)
    axes = drawn.subplots()
    for seed, rows in history.groupby("seed"):
        excess = 100 * (rows["best_misfit"] / unit[seed] - 1)
        style: dict[str, Any] = {"color": ALL_SEEDS, "linewidth": 0.4, "alpha": 0.7}
        if seed == shown:
            style = {"color": FITTED, "linewidth": 1.5, "zorder": 3}
        axes.plot(rows["generation"], excess, **style)
    if len(found) > 1:
        axes.plot([], [], color=ALL_SEEDS, linewidth=0.8, label=seeds_in_words(len(found)))
    axes.plot([], [], color=FITTED, label=typical_in_words(found))
    label = "noise in the trace" if noisy else "lowest misfit"
    axes.axhline(0, color=TARGET, linestyle="--", linewidth=0.8, label=label)
    last = int(history["generation"].max())
    start = case.mutation_start
    if start is not None and start <= last:
        _mutation(axes, start, last)
    axes.set_yscale("symlog", linthresh=1, linscale=0.5)
    axes.set_ylim(bottom=-0.8)
    ticks = [tick for tick in _TICKS if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlim(0, last)
    axes.set_xlabel(case.study.shown_method.step)
    axes.set_ylabel(f"best misfit above {'noise' if noisy else 'the lowest'} (%)")
    if noisy:
        words = near_noise_words(case.study.near_noise_tolerance)
        near = 100 * case.study.near_noise_tolerance
        axes.axhline(near, color=TARGET, linestyle="-.", linewidth=0.8, label=words)
    share = f": {reached.sum()} of {len(found)} {words}" if noisy else ""
    axes.set_title(case.title + share)
    axes.legend(loc="upper right")
    return drawn


def _mutation(axes: Axes, start: int, last: int) -> None:
    """Mark the generation in which mutation starts, with a label below the curves."""
    axes.axvline(start, color=TARGET, linestyle=":", linewidth=0.8)
    before = start > last / 2
    axes.annotate(
        "mutation starts",
        (start, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(-3 if before else 3, 0),
        textcoords="offset points",
        ha="right" if before else "left",
        fontsize=7,
        path_effects=[withStroke(linewidth=2, foreground="white")],
    )
