"""Runs of the methods: Figures 8 and 10 over generations, where all runs end, and their errors."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import NormalDist
from string import ascii_letters
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.judging.verdicts import DETERMINED
from biogrip_study.config.study import Case
from biogrip_study.figures.case_fit import SHOWN_SEEDS, first_of_basins, seeds_in_words
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.identifications import (
    ENCODABLE,
    chi_square_increase,
    near_noise,
    near_noise_words,
    reached_encodable,
    read_histories,
    read_identifications,
    read_verdicts,
    share_in_words,
)
from biogrip_study.tables.study import bounds_at_truth

_TICKS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
# Of increases of chi-squared, smaller ones being drawn there.
_LOWEST = 1e-3


def _line_of_seed(seed: object, first: Mapping[str, int], alpha: float) -> dict[str, Any]:
    for highlighted, color in zip(first.values(), style.RUNS, strict=False):
        if seed == highlighted:
            return {"color": color, "linewidth": 1.5, "zorder": 3}
    return {"color": style.ALL_SEEDS, "linewidth": 0.4, "alpha": alpha}


def _name_seeds(axes: Axes, seeds: int, first: Iterable[str]) -> None:
    if seeds > 1:
        axes.plot([], [], color=style.ALL_SEEDS, linewidth=0.8, label=seeds_in_words(seeds))
    for words, color in zip(first, style.RUNS, strict=False):
        axes.plot([], [], color=color, label=words)


def _runs(
    case: Case, identifications: Path, history: Path, values: Sequence[str]
) -> tuple[pd.DataFrame, dict[str, int], pd.DataFrame]:
    """Return runs of the shown method, the seed of the first in each basin by name, and histories.

    Histories are those of the seeds drawn individually and of these first ones.
    """
    method = case.study.shown_method.name
    identified = read_identifications(identifications, case, method)
    runs = first_of_basins(identified, case)
    first = {words: int(run["seed"]) for words, run in runs.items()}
    histories = read_histories(history, method, values)
    drawn = histories["seed"].isin({*range(SHOWN_SEEDS), *first.values()})
    return identified, first, histories[drawn]


def draw_convergence(case: Case, identifications: Path, history: Path) -> Figure:
    """Draw each seed's excess of the misfit over its noise, highlighting a run of each basin."""
    method, tolerance = case.study.shown_method, case.study.near_noise_tolerance
    identified, first, histories = _runs(case, identifications, history, ["best_misfit"])
    noise = identified.set_index("seed")["noise_rms"]
    noisy = bool((noise > 0).all())
    unit = noise if noisy else pd.Series(identified["misfit"].min(), index=noise.index)
    drawn = style.figure(style.COLUMN_IN, 2.9)
    axes = drawn.subplots()
    for seed, rows in histories.groupby("seed"):
        excess = 100 * (rows["best_misfit"] / unit[seed] - 1)
        axes.plot(rows["generation"], excess, **_line_of_seed(seed, first, 0.7))
    _name_seeds(axes, len(identified), first)
    label = "noise in the trace" if noisy else "lowest misfit"
    axes.axhline(0, color=style.TARGET, linestyle="--", linewidth=0.8, label=label)
    last = int(histories["generation"].max())
    start = case.block.method("genetic").mutation_start
    if method.name == "genetic" and start <= last:
        axes.axvline(
            start, color=style.TARGET, linestyle=":", linewidth=0.8, label="mutation starts"
        )
    axes.set_yscale("symlog", linthresh=1, linscale=0.5)
    axes.set_ylim(bottom=-0.8)
    ticks = [tick for tick in _TICKS if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set(xlim=(0, last), xlabel=method.step, title=case.title)
    axes.set_ylabel(f"best misfit above {'noise' if noisy else 'the lowest'} (%)")
    if noisy:
        words, near = near_noise_words(tolerance), 100 * tolerance
        axes.axhline(near, color=style.TARGET, linestyle="-.", linewidth=0.8, label=words)
        reached = near_noise(identified, tolerance).sum()
        axes.set_title(f"{case.title}: {reached} of {len(identified)} {words}")
    drawn.legend(loc="outside lower center", ncols=2)
    return drawn


def draw_evolution(case: Case, identifications: Path, history: Path) -> Figure:
    """Draw every parameter over generations for all seeds, highlighting a run of each basin."""
    parameters, identified = case.sample.model.parameters, case.published.identified
    columns = [parameter.column for parameter in parameters]
    identified_runs, first, histories = _runs(case, identifications, history, columns)
    down = -(-len(parameters) // 2)
    drawn = style.figure(style.COLUMN_IN, 1.2 + 1.5 * down)
    grid = drawn.subplots(down, 2, sharex=True).ravel()
    for axes, parameter in zip(grid, parameters, strict=False):
        for seed, rows in histories.groupby("seed"):
            look = _line_of_seed(seed, first, 0.6)
            axes.step(rows["generation"], rows[parameter.column], where="post", **look)
        target = case.parameters.get(parameter.name, 0)
        if target > 0:
            axes.axhline(target, color=style.TARGET, linestyle="--")
        if parameter.name in identified:
            axes.axhline(identified[parameter.name], color=style.PAPER, linestyle=":")
        if np.any(histories[parameter.column] > 0):
            axes.set_yscale("log")
        axes.set_ylabel(with_unit(parameter.symbol, parameter.unit))
        axes.set_xlim(0, histories["generation"].max())
    for axes in grid[len(parameters) :]:
        axes.set_axis_off()
    for axes in grid[len(parameters) - 2 : len(parameters)]:
        axes.set_xlabel(case.study.shown_method.step)
        axes.tick_params(labelbottom=True)
    _name_seeds(grid[0], len(identified_runs), first)
    if case.parameters:
        grid[0].plot([], [], color=style.TARGET, linestyle="--", label="target")
    if identified:
        grid[0].plot([], [], color=style.PAPER, linestyle=":", label="identified in the paper")
    drawn.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    drawn.suptitle(case.title, x=0.01, ha="left", fontsize=8)
    return drawn


def draw_waterfall(case: Case, identifications: Path) -> Figure:
    """Draw sorted increases of chi-squared, of every method's runs and of best encodable points."""
    identified = read_identifications(identifications, case)
    increase = np.maximum(chi_square_increase(identified, case), _LOWEST)
    reached = reached_encodable(identified, case)
    drawn = style.figure(style.COLUMN_IN, 3.5)
    axes = drawn.subplots()
    methods = identified["method"].unique()
    # Where curves coincide each is seen beside the thinner ones on top of it.
    for name, width in zip(methods, np.linspace(3.2, 1.0, len(methods)), strict=True):
        method = METHODS[name]
        runs = identified["method"] == name
        mine = np.sort(increase[runs])
        place = 100 * (np.arange(len(mine)) + 0.5) / len(mine)
        label = f"{method.title}: {share_in_words(int(reached[runs].sum()), len(mine))}"
        look = {"color": style.COLORS[method.color], "linewidth": width}
        axes.plot(place, mine, label=label, linestyle=method.dashes, **look)
    least = np.sort(chi_square_increase(identified, case, ENCODABLE)[runs]).clip(_LOWEST)
    axes.plot(place, least, "--", color=style.TARGET, linewidth=0.8, label="best encodable point")
    axes.set(yscale="log", ylim=(_LOWEST / 2, 5 * float(increase.max())))
    ticks = [tick for tick in 10.0 ** np.arange(-3, 7) if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"≤{_LOWEST:g}", *(f"{tick:g}" for tick in ticks[1:])])
    axes.minorticks_off()
    axes.set(xlim=(0, 100), xlabel="seeds, sorted (%)", ylabel="Δχ² over the lowest known")
    axes.set_title(f"{case.title}: best encodable point reached")
    drawn.legend(loc="outside lower left")
    return drawn


# Bounds on both sides of 1 that an axis shows, more where quartiles are further off; where that
# leaves no room above zero, it shows decades.
_WIDTHS, _LOOSE, _MOST_DECADES = 8.0, 0.95, 4
# Points at the edge would make the layout leave them room.
_DOTS: dict[str, Any] = {
    "linestyle": "", "marker": "o", "markersize": 2, "markeredgewidth": 0, "alpha": 0.55,
    "clip_on": False, "in_layout": False,
}  # fmt: skip


def draw_scatter(
    case: Case, identifications: Path, target: Path, expected: Path, calibrated: list[Path]
) -> Figure:
    """Draw identified over target for every quantity and method."""
    verdicts = {item["quantity"]: item["verdict"] for item in read_verdicts(expected)["quantities"]}
    identified = read_identifications(identifications, case)
    bounds = bounds_at_truth(case, target, calibrated)
    drawn, grid = style.row_of_panels(len(bounds), 3.1)
    for index, (axes, (quantity, limit)) in enumerate(zip(grid, bounds, strict=True)):
        names = [case.experiment.searched.parameters[i] for i in quantity.members]
        value = sum(case.parameters[p.name] for p in names)
        if value == 0:
            axes.axis("off")
            continue
        ratios = identified[[p.column for p in names]].sum(axis=1) / value
        verdict = verdicts[quantity.label]
        # The bound is a tangent at the truth: no use if the quantity is not determined, or if it
        # is zero.
        known = limit if limit and verdict == DETERMINED else np.inf
        _quantity(axes, case, identified["method"], ratios.to_numpy(float), known)
        if {p.name for p in names} <= {*(printed := case.published.identified)}:
            ratio = np.clip(sum(printed[p.name] for p in names) / value, *axes.get_ylim())
            axes.axhline(ratio, color=style.PAPER, linewidth=1.2, linestyle=(0, (4, 2)))
        said = f"{100 * known:.2g} %" if np.isfinite(known) else verdict.split(" above")[0]
        style.panel(axes, ascii_letters[index], f"{quantity.symbol}: {said}", 60)
        if index == 0:
            axes.set_ylabel("identified / target")
    _legend(drawn, case, list(identified["method"].unique()), identified["seed"].nunique())
    return drawn


def _quantity(
    axes: Axes, case: Case, methods: "pd.Series[str]", ratios: Array, limit: float
) -> None:
    """Draw one column of points per method, with points beyond the axis at its edge."""
    names = list(methods.unique())
    of_methods = [ratios[(methods == name).to_numpy()] for name in names]
    quartiles = np.percentile(of_methods, [25, 50, 75], axis=1).T
    reach = max(_WIDTHS * limit, 1.1 * float(np.max(np.abs(quartiles - 1))))
    loose = reach > _LOOSE
    ends = np.log10(np.maximum(quartiles, 10.0**-_MOST_DECADES))
    decades = float(np.clip(np.ceil(np.max(np.abs(ends))), 1, _MOST_DECADES))
    bottom, top = (10**-decades, 10**decades) if loose else (1 - reach, 1 + reach)
    for place, (name, mine) in enumerate(zip(names, of_methods, strict=True)):
        shown = mine[:SHOWN_SEEDS]
        # A fixed sideways scatter keeps points apart.
        x = place + 0.6 * ((np.arange(len(shown)) * 0.618034) % 1 - 0.5)
        look = _DOTS | {"color": style.COLORS[METHODS[name].color]}
        points, ends = np.column_stack([x, shown]), ((-np.inf, bottom), (np.inf, top))
        style.points_within(axes, points, *ends, look, edge_size=3)
        low, middle, high = np.clip(quartiles[place], bottom, top)
        axes.plot([place, place], [low, high], color=style.TARGET, linewidth=1.0)
        axes.plot([place - 0.3, place + 0.3], [middle, middle], color=style.TARGET, linewidth=1.4)
    if np.isfinite(limit):
        half = NormalDist().inv_cdf((1 + case.confidence) / 2) * limit
        # Of the logarithm, straight where the axis is.
        low, high = (np.exp(-half), np.exp(half)) if loose else (1 - half, 1 + half)
        axes.axhspan(low, high, color=style.SHADE, zorder=0, linewidth=0)
    axes.axhline(1, color=style.TARGET, linewidth=0.6)
    if loose:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(numticks=5))
        axes.minorticks_off()
    else:
        axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set(ylim=(bottom, top), xlim=(-0.6, len(names) - 0.4))
    axes.set_xticks([])


def _legend(drawn: Figure, case: Case, methods: list[str], seeds: int) -> None:
    axes = drawn.axes[0]
    marks = [(METHODS[name].title, "o", style.COLORS[METHODS[name].color]) for name in methods]
    handles: list[Any] = []
    for label, marker, color in [*marks, ("beyond the axis", "^", style.TARGET)]:
        look: dict[str, Any] = {"color": color, "markersize": 4, "markeredgewidth": 0}
        handles += axes.plot([], [], marker, label=label, **look)
    label = f"{100 * case.confidence:g} % by the Cramér-Rao bound (named above), rest known"
    handles.append(axes.fill([], [], color=style.SHADE, label=label)[0])
    if case.published.identified:
        handles += axes.plot([], [], color=style.PAPER, linestyle=(0, (4, 2)), label="paper")
    drawn.legend(handles=handles, loc="outside lower left", ncols=3)
    few = "" if seeds <= SHOWN_SEEDS else f": {seeds_in_words(seeds)}, quartiles of all"
    drawn.suptitle(case.title + few, x=0.01, ha="left", fontsize=8)
