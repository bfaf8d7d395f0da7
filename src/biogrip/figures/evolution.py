"""Figure 10: parameters of the best individual over generations."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from biogrip.digits import with_unit
from biogrip.figures.results import read_history, seeds_in_words, typical_in_words
from biogrip.figures.style import ALL_SEEDS, FITTED, PAGE_IN, PAPER, TARGET, figure
from biogrip.fit.methods import typical
from biogrip.records.identifications import read_identifications
from biogrip.study.study import Case


def draw(case: Case, identifications: Path, histories: Path) -> Figure:
    """Draw every parameter over generations for all seeds, highlighting the typical seed."""
    truth, step = case.truth, case.study.shown_method.step
    found = read_identifications(identifications, case.study.shown_method.name)
    shown = int(typical(found)["seed"])
    parameters = truth.model.parameters
    columns = [parameter.column for parameter in parameters]
    history = read_history(histories, case.study.shown_method.name, shown, columns)
    identified = truth.published.identified
    drawn = figure(PAGE_IN, 3.9)
    grid = drawn.subplots(2, -(-len(parameters) // 2), sharex=True).ravel()
    for axes, parameter in zip(grid, parameters, strict=False):
        for seed, rows in history.groupby("seed"):
            style = {"color": ALL_SEEDS, "linewidth": 0.4, "alpha": 0.6}
            if seed == shown:
                style = {"color": FITTED, "linewidth": 1.5, "zorder": 3}
            axes.step(rows["generation"], rows[parameter.column], where="post", **style)
        if truth.parameters.get(parameter.name, 0) > 0:
            axes.axhline(truth.parameters[parameter.name], color=TARGET, linestyle="--")
        if parameter.name in identified:
            axes.axhline(identified[parameter.name], color=PAPER, linestyle=":")
        if np.any(history[parameter.column] > 0):
            axes.set_yscale("log")
        axes.set_ylabel(with_unit(parameter.symbol, parameter.unit))
        if truth.parameters.get(parameter.name, 0) > 0:
            last = history.loc[history["seed"] == shown, parameter.column].iloc[-1]
            ends = _beside(last / truth.parameters[parameter.name])
            axes.set_title(f"seed {shown} ends {ends}", loc="right", fontsize=7)
        axes.set_xlim(0, history["generation"].max())
    for axes in grid[len(parameters) :]:
        axes.set_axis_off()
    half = len(grid) // 2
    for axes, below in zip(grid[:half], grid[half:], strict=True):
        lowest = below if below.get_visible() and below.axison else axes
        lowest.set_xlabel(step)
        lowest.tick_params(labelbottom=True)
    lines, labels = [], []
    if len(found) > 1:
        lines.append(grid[0].plot([], [], color=ALL_SEEDS, linewidth=0.8)[0])
        labels.append(seeds_in_words(len(found)))
    lines.append(grid[0].plot([], [], color=FITTED)[0])
    labels.append(typical_in_words(found))
    if truth.parameters:
        lines.append(grid[0].plot([], [], color=TARGET, linestyle="--")[0])
        labels.append("target")
    if identified:
        lines.append(grid[0].plot([], [], color=PAPER, linestyle=":")[0])
        labels.append("identified in the paper")
    drawn.legend(lines, labels, loc="outside upper center", ncols=4)
    drawn.suptitle(truth.title, x=0.01, ha="left", fontsize=8)
    return drawn


def _beside(ratio: float) -> str:
    """Return the distance to the target in words, as a few percent are invisible on the axis."""
    if not 0.5 < ratio < 2:
        return f"at {ratio:.2g} times the target"
    percent = 100 * (ratio - 1)
    if abs(percent) < 0.05:
        return "at the target"
    return f"{abs(percent):.2g} % {'above' if percent > 0 else 'below'} the target"
