"""The course of the methods: Figures 8 and 10 over generations, and where all runs end."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from biogrip.digits import with_unit
from biogrip.figures.fit import first_of_basins, read_history, seeds_in_words
from biogrip.figures.style import (
    ALL_SEEDS,
    COLUMN_IN,
    PAPER,
    RUNS,
    TARGET,
    figure,
    line_of,
)
from biogrip.records.identifications import ENCODABLE, read_identifications
from biogrip.records.success import (
    chi_square_increase,
    near_noise,
    near_noise_words,
    reached_encodable,
    share_in_words,
)
from biogrip.study.study import Case

_TICKS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
# Of increases of chi-squared, smaller ones being drawn there.
_LOWEST = 1e-3


def _line_of_seed(seed: object, shown: Sequence[int], alpha: float) -> dict[str, Any]:
    if seed in shown:
        return {"color": RUNS[shown.index(seed)], "linewidth": 1.5, "zorder": 3}
    return {"color": ALL_SEEDS, "linewidth": 0.4, "alpha": alpha}


def _name_seeds(axes: Axes, seeds: int, first: Iterable[str]) -> None:
    """Add to the legend what the lines of seeds are."""
    if seeds > 1:
        axes.plot([], [], color=ALL_SEEDS, linewidth=0.8, label=seeds_in_words(seeds))
    for words, color in zip(first, RUNS, strict=False):
        axes.plot([], [], color=color, label=words)


def draw_convergence(case: Case, identifications: Path, histories: Path) -> Figure:
    """Draw each seed's excess of the misfit over its noise, highlighting a run of each basin."""
    method, tolerance = case.study.shown_method, case.study.near_noise_tolerance
    found = read_identifications(identifications, case, method.name)
    noise = found.set_index("seed")["noise_rms"]
    noisy = bool((noise > 0).all())
    unit = noise if noisy else pd.Series(found["misfit"].min(), index=noise.index)
    first = first_of_basins(found, tolerance)
    shown = [int(run["seed"]) for run in first.values()]
    history = read_history(histories, method.name, shown)
    drawn = figure(COLUMN_IN, 2.9)
    axes = drawn.subplots()
    for seed, rows in history.groupby("seed"):
        excess = 100 * (rows["best_misfit"] / unit[seed] - 1)
        axes.plot(rows["generation"], excess, **_line_of_seed(seed, shown, 0.7))
    _name_seeds(axes, len(found), first)
    label = "noise in the trace" if noisy else "lowest misfit"
    axes.axhline(0, color=TARGET, linestyle="--", linewidth=0.8, label=label)
    last = int(history["generation"].max())
    if "genetic_algorithm" in method.blocks:
        mutation_start = case.block.genetic_algorithm.mutation_start
        if mutation_start <= last:
            _mark_mutation(axes, mutation_start, last)
    axes.set_yscale("symlog", linthresh=1, linscale=0.5)
    axes.set_ylim(bottom=-0.8)
    ticks = [tick for tick in _TICKS if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set(xlim=(0, last), xlabel=method.step, title=case.title)
    axes.set_ylabel(f"best misfit above {'noise' if noisy else 'the lowest'} (%)")
    if noisy:
        words, near = near_noise_words(tolerance), 100 * tolerance
        axes.axhline(near, color=TARGET, linestyle="-.", linewidth=0.8, label=words)
        reached = near_noise(found, tolerance).sum()
        axes.set_title(f"{case.title}: {reached} of {len(found)} {words}")
    drawn.legend(loc="outside lower center", ncols=2)
    return drawn


def _mark_mutation(axes: Axes, start: int, last: int) -> None:
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


def draw_evolution(case: Case, identifications: Path, histories: Path) -> Figure:
    """Draw every parameter over generations for all seeds, highlighting a run of each basin."""
    method = case.study.shown_method
    found = read_identifications(identifications, case, method.name)
    first = first_of_basins(found, case.study.near_noise_tolerance)
    shown = [int(run["seed"]) for run in first.values()]
    parameters, identified = case.sample.model.parameters, case.published.identified
    columns = [parameter.column for parameter in parameters]
    history = read_history(histories, method.name, shown, columns)
    drawn = figure(COLUMN_IN, 1.2 + 1.5 * (rows := -(-len(parameters) // 2)))
    grid = drawn.subplots(rows, 2, sharex=True).ravel()
    for axes, parameter in zip(grid, parameters, strict=False):
        for seed, rows in history.groupby("seed"):
            style = _line_of_seed(seed, shown, 0.6)
            axes.step(rows["generation"], rows[parameter.column], where="post", **style)
        target = case.parameters.get(parameter.name, 0)
        if target > 0:
            axes.axhline(target, color=TARGET, linestyle="--")
        if parameter.name in identified:
            axes.axhline(identified[parameter.name], color=PAPER, linestyle=":")
        if np.any(history[parameter.column] > 0):
            axes.set_yscale("log")
        axes.set_ylabel(with_unit(parameter.symbol, parameter.unit))
        axes.set_xlim(0, history["generation"].max())
    for axes in grid[len(parameters) :]:
        axes.set_axis_off()
    for axes in grid[len(parameters) - 2 : len(parameters)]:
        axes.set_xlabel(method.step)
        axes.tick_params(labelbottom=True)
    _name_seeds(grid[0], len(found), first)
    if case.parameters:
        grid[0].plot([], [], color=TARGET, linestyle="--", label="target")
    if identified:
        grid[0].plot([], [], color=PAPER, linestyle=":", label="identified in the paper")
    handles, labels = grid[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=2)
    drawn.suptitle(case.title, x=0.01, ha="left", fontsize=8)
    return drawn


def draw_waterfall(case: Case, identifications: Path) -> Figure:
    """Draw sorted increases of chi-squared, of every method's runs and of best encodable points."""
    found = read_identifications(identifications, case)
    increase = np.maximum(chi_square_increase(found, case.samples), _LOWEST)
    reached = reached_encodable(found, case.samples, case.study.optimum_tolerance)
    drawn = figure(COLUMN_IN, 3.5)
    axes = drawn.subplots()
    methods = found["method"].unique()
    # Where curves coincide each is seen beside the thinner ones on top of it.
    for name, width in zip(methods, np.linspace(3.2, 1.0, len(methods)), strict=True):
        method = case.study.identifiers[name]
        runs = found["method"] == name
        mine = np.sort(increase[runs])
        place = 100 * (np.arange(len(mine)) + 0.5) / len(mine)
        label = f"{method.title}: {share_in_words(int(reached[runs].sum()), len(mine))}"
        axes.plot(place, mine, label=label, linewidth=width, **line_of(method))
    least = np.sort(chi_square_increase(found, case.samples, ENCODABLE)[runs]).clip(_LOWEST)
    axes.plot(place, least, "--", color=TARGET, linewidth=0.8, label="best encodable point")
    axes.set(yscale="log", ylim=(_LOWEST / 2, 5 * float(increase.max())))
    ticks = [tick for tick in 10.0 ** np.arange(-3, 7) if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"≤{_LOWEST:g}", *(f"{tick:g}" for tick in ticks[1:])])
    axes.minorticks_off()
    axes.set(xlim=(0, 100), xlabel="seeds, sorted (%)", ylabel="Δχ² over the lowest known")
    axes.set_title(f"{case.title}: best encodable point reached")
    drawn.legend(loc="outside lower left")
    return drawn
