"""Number of experiments until parameters of simulated cells are known."""

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.products.designed_cases import WELL
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import BLUE, GREY, ORANGE, PAGE_IN, PURPLE, figure, panel
from biogrip.products.files.sequences import SEQUENCES
from biogrip.products.product import Reads
from biogrip.products.stages.sequence import AFTER, BEFOREHAND, REPEATED, TRUTH, sequenced
from biogrip.products.tables.sequential import IN_WORDS, files_of, half_widths, known_well
from biogrip.products.uses import from_case, to_identify
from biogrip.study.study import Case

_STYLES: dict[str, dict[str, Any]] = {
    REPEATED: {"color": GREY, "marker": "s", "linestyle": "-"},
    BEFOREHAND: {"color": PURPLE, "marker": "^", "linestyle": "-."},
    AFTER: {"color": ORANGE, "marker": "o", "linestyle": "-"},
    TRUTH: {"color": BLUE, "marker": "D", "linestyle": "--"},
}

# Height at which intervals with an open end are drawn, in percent.
_OPEN = 100.0


def draw(case: Case, rows: list[Path]) -> Figure:
    """Draw the share of cells in which each quantity is known, and the intervals' half widths."""
    symbols = {p.name: p.symbol for p in case.problem.searched.parameters}
    found = pd.concat([SEQUENCES.read(file) for file in rows])
    found = found.assign(well=known_well(found), half=half_widths(found))
    drawn = figure(PAGE_IN, 3.8)
    grid = drawn.subplots(2, len(symbols) + 1, sharex=True, sharey="row", squeeze=False)
    for column, (name, symbol) in enumerate(symbols.items()):
        own = found[found["quantity"] == name].groupby(["way", "experiments"])
        _lines(grid[0, column], 100 * own["well"].mean())
        _lines(grid[1, column], (100 * own["half"].median()).clip(upper=_OPEN))
        panel(grid[0, column], chr(ord("a") + column), symbol)
        grid[1, column].axhline(100 * WELL, color=GREY, lw=0.6, ls=":")
        grid[1, column].set_xlabel("experiments")
    exchangeable = found.groupby(["way", "experiments", "cell"])["well"].all()
    _lines(grid[0, -1], 100 * exchangeable.groupby(["way", "experiments"]).mean())
    panel(grid[0, -1], chr(ord("a") + len(symbols)), "all of them")
    grid[0, -1].set_xlabel("experiments")
    grid[0, -1].tick_params(labelbottom=True)
    grid[0, 0].set(ylim=(-6, 106), ylabel=f"known to {100 * WELL:g} %\n(% of cells)")
    grid[1, 0].set(yscale="log", ylim=(0.2, 1.3 * _OPEN))
    grid[1, 0].set_yticks([1, 10, _OPEN], ["1", "10", "open"])
    grid[1, 0].set_ylabel("half of the interval,\nmedian (%)")
    grid[1, -1].set_axis_off()
    handles, labels = grid[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=2)
    return drawn


def _lines(axes: Axes, values: "pd.Series[float]") -> None:
    """Draw one line per way, over the number of experiments."""
    for way, style in _STYLES.items():
        own = values[way]
        axes.plot(own.index, own.to_numpy(), label=IN_WORDS[way], markersize=3.5, **style)
    axes.set_xticks(sorted({count for _, count in values.index}))


SEQUENTIAL_FIGURE = drawing(
    draw,
    name="sequential_figure",
    file="sequential",
    caption="In how many simulated cells quantities are known to "
    f"{100 * WELL:g} %, by their interval from the profile likelihood, after so many experiments "
    "(above), and half of that interval in the median cell, `open` where it has one end (below): "
    "the study's experiment repeated; that once, and each next one designed from what all before "
    "told; one designed for all cells, repeated; one designed for the true cell, repeated.",
    uses=from_case(problem=to_identify),
    reads={"rows": Reads(lambda plan, job: files_of(plan, job["case"]))},
    cases=sequenced,
)
