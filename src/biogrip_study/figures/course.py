"""Runs of the methods: Figures 8 and 10 over generations, and where all runs end."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import biogrip_study.records.identifications as records
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip_study.config.study import Case
from biogrip_study.figures.case_fit import SHOWN_SEEDS, first_of_basins, seeds_in_words
from biogrip_study.methods.registry import METHODS

# Of increases of chi-squared, smaller ones being drawn there.
_LOWEST = 1e-3
_SEED: dict[str, Any] = {"color": style.ALL_SEEDS, "linewidth": 0.4, "alpha": 0.65}


def _runs(
    case: Case, identifications: Path, history: Path, values: Sequence[str]
) -> tuple[pd.DataFrame, pd.DataFrame, dict[int, dict[str, Any]]]:
    """Return runs of the shown method, histories, and the look of the first run in each basin.

    Histories are those of the seeds drawn individually and of these first ones.
    """
    method = case.study.shown_method.name
    identified = records.read_identifications(identifications, case, method)
    looks: dict[int, dict[str, Any]] = {}
    runs = first_of_basins(identified, case).items()
    for (words, run), color in zip(runs, style.RUNS, strict=False):
        look = {"color": color, "linewidth": 1.5, "zorder": 3, "label": words}
        looks[int(run["seed"])] = look
    histories = records.read_histories(history, method, values)
    drawn = histories["seed"].isin({*range(SHOWN_SEEDS), *looks})
    return identified, histories[drawn], looks


def _draw_seeds(
    axes: Axes, histories: pd.DataFrame, column: str, seeds: int, looks: Mapping[int, Any]
) -> None:
    """Draw a column over generations, a line a seed."""
    if seeds > 1:
        axes.plot([], [], color=style.ALL_SEEDS, label=seeds_in_words(seeds))
    for seed, rows in histories.groupby("seed"):
        axes.step(rows["generation"], rows[column], where="post", **looks.get(seed, _SEED))
    axes.set_xlim(0, histories["generation"].max())


def draw_convergence(case: Case, identifications: Path, history: Path) -> Figure:
    """Draw each seed's excess of the misfit over its noise, highlighting a run of each basin."""
    method = case.study.shown_method
    identified, histories, looks = _runs(case, identifications, history, ["best_misfit"])
    noise = identified.set_index("seed")["noise_rms"]
    noisy = bool((noise > 0).all())
    unit = noise if noisy else pd.Series(identified["misfit"].min(), index=noise.index)
    drawn = style.figure(style.COLUMN_IN, 2.9)
    axes = drawn.subplots()
    excess = 100 * (histories["best_misfit"] / histories["seed"].map(unit) - 1)
    _draw_seeds(axes, histories.assign(excess=excess), "excess", len(identified), looks)
    reference = "noise" if noisy else "the lowest"
    line: dict[str, Any] = {"color": style.TARGET, "linewidth": 0.8}
    axes.axhline(0, linestyle="--", label=reference, **line)
    start = case.block.method("genetic").mutation_start
    if method.name == "genetic" and start <= histories["generation"].max():
        axes.axvline(start, linestyle=":", label="mutation starts", **line)
    title = case.title
    if noisy:
        words = records.near_noise_words(case.study)
        axes.axhline(100 * case.study.near_noise_tolerance, linestyle="-.", label=words, **line)
        reached = records.near_noise(identified, case.study).sum()
        title += f": {reached} of {len(identified)} {words}"
    axes.set_yscale("symlog", linthresh=1, linscale=0.5)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set(xlabel=method.step, title=title, ylim=(-0.8, None))
    axes.set_ylabel(f"best misfit above {reference} (%)")
    drawn.legend(loc="outside lower center", ncols=2)
    return drawn


def draw_evolution(case: Case, identifications: Path, history: Path) -> Figure:
    """Draw every parameter over generations for all seeds, highlighting a run of each basin."""
    parameters, printed = case.sample.model.parameters, case.published.identified
    columns = [parameter.column for parameter in parameters]
    identified, histories, looks = _runs(case, identifications, history, columns)
    down = -(-len(parameters) // 2)
    drawn = style.figure(style.COLUMN_IN, 1.2 + 1.5 * down)
    grid = drawn.subplots(down, 2).ravel()
    for axes in grid[len(parameters) :]:
        axes.set_axis_off()
    for axes, parameter in zip(grid, parameters, strict=False):
        _draw_seeds(axes, histories, parameter.column, len(identified), looks)
        if (target := case.parameters.get(parameter.name, 0)) > 0:
            axes.axhline(target, color=style.TARGET, linestyle="--", label="target")
        if parameter.name in printed:
            label = "identified in the paper"
            axes.axhline(printed[parameter.name], color=style.PAPER, linestyle=":", label=label)
        if np.any(histories[parameter.column] > 0):
            axes.set_yscale("log")
        axes.set_ylabel(with_unit(parameter.symbol, parameter.unit))
    for axes in grid[len(parameters) - 2 : len(parameters)]:
        axes.set_xlabel(case.study.shown_method.step)
    drawn.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    drawn.suptitle(case.title, x=0.01, ha="left", fontsize=8)
    return drawn


def draw_waterfall(case: Case, identifications: Path) -> Figure:
    """Draw sorted increases of chi-squared, of every method's runs and of best encodable points."""
    identified = records.read_identifications(identifications, case)
    increase = np.maximum(records.chi_square_increase(identified, case), _LOWEST)
    reached = records.reached_encodable(identified, case)
    drawn = style.figure(style.COLUMN_IN, 3.5)
    axes = drawn.subplots()
    methods = identified["method"].unique()
    # Where curves coincide each is seen beside the thinner ones on top of it.
    for name, width in zip(methods, np.linspace(3.2, 1.0, len(methods)), strict=True):
        method, runs = METHODS[name], identified["method"] == name
        place = 100 * (np.arange(runs.sum()) + 0.5) / runs.sum()
        label = f"{method.title}: {records.share_in_words(int(reached[runs].sum()), len(place))}"
        look = {"color": style.COLORS[method.color], "linewidth": width}
        axes.plot(place, np.sort(increase[runs]), label=label, linestyle=method.dashes, **look)
    least = np.sort(records.chi_square_increase(identified, case, records.ENCODABLE)[runs]).clip(
        _LOWEST
    )
    axes.plot(place, least, "--", color=style.TARGET, linewidth=0.8, label="best encodable point")
    axes.set(yscale="log", ylim=(_LOWEST / 2, None), xlim=(0, 100), xlabel="seeds, sorted (%)")
    axes.set_ylabel(f"Δχ² over the lowest known, {_LOWEST:g} or more")
    axes.set_title(f"{case.title}: best encodable point reached")
    drawn.legend(loc="outside lower left")
    return drawn
