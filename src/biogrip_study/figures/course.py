"""Runs of the methods: Figures 8 and 10 over generations, where all runs end, and their errors."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import NormalDist
from string import ascii_letters
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import biogrip_study.records.identifications as records
from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.judging.likelihood import parameters_and_sum, quantity_value
from biogrip.judging.profiles import DETERMINED
from biogrip_study.config.study import Case
from biogrip_study.figures.case_fit import SHOWN_SEEDS, draw_runs, first_of_basins, seeds_in_words
from biogrip_study.methods.registry import METHODS
from biogrip_study.tables.study import bounds_at_truth

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


# Bounds on both sides of 1 that an axis shows, more where quartiles are further off; where that
# leaves no room above zero, it shows decades.
_WIDTHS, _LOOSE, _MOST_DECADES = 8.0, 0.95, 4
_PAPER: dict[str, Any] = {"color": style.PAPER, "linestyle": (0, (4, 2))}


def draw_scatter(case: Case, identifications: Path, target: Path, expected: Path) -> Figure:
    """Draw identified over target for every quantity and method."""
    verdicts = {
        item["quantity"]: item["verdict"] for item in records.read_verdicts(expected)["quantities"]
    }
    identified = records.read_identifications(identifications, case)
    values = records.values_by_quantity(identified, case.experiment.searched)
    printed = case.published.identified
    bounds = bounds_at_truth(case, target)
    drawn, grid = style.row_of_panels(len(bounds), 3.1)
    quantities = parameters_and_sum(case.experiment.searched)
    for index, (axes, quantity) in enumerate(zip(grid, quantities, strict=True)):
        limit = bounds[quantity.label]
        true = quantity_value(quantity.label, case.parameters)
        if not true:
            axes.axis("off")
            continue
        verdict = verdicts[quantity.label]
        # The bound is a tangent at the truth: no use if the quantity is not determined, or if it
        # is zero.
        known = limit if limit and verdict == DETERMINED else np.inf
        ratios = (values[quantity.label] / true).groupby(identified["method"], sort=False)
        _draw_ratios(axes, case, {str(name): of.to_numpy(float) for name, of in ratios}, known)
        if (paper := quantity_value(quantity.label, printed)) is not None:
            axes.axhline(np.clip(paper / true, *axes.get_ylim()), **_PAPER)
        said = f"{100 * known:.2g} %" if np.isfinite(known) else verdict.split(" above")[0]
        style.panel(axes, ascii_letters[index], f"{quantity.symbol}: {said}", 60)
    grid[0].set_ylabel("identified / target")
    _legend(drawn, case, identified["seed"].nunique())
    return drawn


def _draw_ratios(axes: Axes, case: Case, of_methods: Mapping[str, Array], limit: float) -> None:
    """Draw one column of points per method, with points beyond the axis at its edge."""
    quartiles = np.percentile([*of_methods.values()], [25, 50, 75], axis=1).T
    reach = max(_WIDTHS * limit, 1.1 * float(np.max(np.abs(quartiles - 1))))
    loose = reach > _LOOSE
    ends = np.log10(np.maximum(quartiles, 10.0**-_MOST_DECADES))
    decades = float(np.clip(np.ceil(np.max(np.abs(ends))), 1, _MOST_DECADES))
    bottom, top = (10**-decades, 10**decades) if loose else (1 - reach, 1 + reach)
    for place, (name, ratios) in enumerate(of_methods.items()):
        color = style.COLORS[METHODS[name].color]
        draw_runs(axes, place, ratios[:SHOWN_SEEDS], (bottom, top), color)
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
    axes.set(ylim=(bottom, top), xlim=(-0.6, len(of_methods) - 0.4), xticks=[])


def _legend(drawn: Figure, case: Case, seeds: int) -> None:
    axes = drawn.axes[0]
    methods = [METHODS[name] for name in case.study.config.methods]
    marks = [(method.title, "o", style.COLORS[method.color]) for method in methods]
    for label, marker, color in [*marks, ("beyond the axis", "^", style.TARGET)]:
        axes.plot([], [], marker, color=color, markersize=4, markeredgewidth=0, label=label)
    label = f"{100 * case.confidence:g} % by the Cramér-Rao bound (named above), rest known"
    axes.fill([], [], color=style.SHADE, label=label)
    if case.published.identified:
        axes.plot([], [], label="paper", **_PAPER)
    drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=3)
    few = "" if seeds <= SHOWN_SEEDS else f": {seeds_in_words(seeds)}, quartiles of all"
    drawn.suptitle(case.title + few, x=0.01, ha="left", fontsize=8)
