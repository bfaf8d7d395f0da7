"""Figure 10: the best individual's parameters from step to step."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from biogrip.figures.results import read_history, seeds_in_words
from biogrip.figures.style import ALL_SEEDS, FITTED, PAGE_IN, PAPER, TARGET, figure
from biogrip.identify.identifications import lowest_misfit, read_identifications
from biogrip.study import build


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw every parameter's evolution for the seeds and for the best.

    Parameters
    ----------
    settings
        ``method``, its ``step``, ``title``, ``model``, ``parameters``, ``published``.
    inputs
        Identifications (CSV) and histories (Parquet) of the case.
    """
    found = read_identifications(inputs[0], settings["method"])
    best = int(lowest_misfit(found)["seed"])
    history = read_history(inputs[1], settings["method"], best)
    parameters = build.sample_model(settings).parameters
    identified = settings["published"].get("identified", {})
    drawn = figure(PAGE_IN, 3.9)
    grid = drawn.subplots(2, -(-len(parameters) // 2), sharex=True).ravel()
    for axes, parameter in zip(grid, parameters, strict=False):
        for seed, rows in history.groupby("seed"):
            style = {"color": ALL_SEEDS, "linewidth": 0.4, "alpha": 0.6}
            if seed == best:
                style = {"color": FITTED, "linewidth": 1.5, "zorder": 3}
            axes.step(rows["generation"], rows[parameter.column], where="post", **style)
        if settings["parameters"].get(parameter.name, 0) > 0:
            axes.axhline(settings["parameters"][parameter.name], color=TARGET, linestyle="--")
        if parameter.name in identified:
            axes.axhline(identified[parameter.name], color=PAPER, linestyle=":")
        axes.set_yscale("log")
        axes.set_ylabel(f"{parameter.symbol} ({parameter.unit})")
        axes.set_xlim(0, history["generation"].max())
    for axes in grid[len(parameters) :]:
        axes.set_axis_off()
    columns = len(grid) // 2
    for axes, below in zip(grid[:columns], grid[columns:], strict=True):
        lowest = below if below.get_visible() and below.axison else axes
        lowest.set_xlabel(settings["step"])
        lowest.tick_params(labelbottom=True)
    lines = [
        grid[0].plot([], [], color=ALL_SEEDS, linewidth=0.8)[0],
        grid[0].plot([], [], color=FITTED)[0],
    ]
    labels = [seeds_in_words(len(found)), f"seed {best}, lowest misfit"]
    if settings["parameters"]:
        lines.append(grid[0].plot([], [], color=TARGET, linestyle="--")[0])
        labels.append("target")
    if identified:
        lines.append(grid[0].plot([], [], color=PAPER, linestyle=":")[0])
        labels.append("identified in the paper")
    drawn.legend(lines, labels, loc="outside upper center", ncols=4)
    drawn.suptitle(settings["title"], x=0.01, ha="left", fontsize=8)
    return drawn
