"""Groups of a study's sheet: populations, differences, and a figure of all cells."""

import json
from dataclasses import dataclass
from math import exp
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from biogrip.digits import rounded_numbers, with_unit
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.own_traces.fitted_cells import (
    BATCHES,
    CellToFit,
    every_cell,
    jobs_of_cells,
    read_cell,
)
from biogrip.own_traces.groups_of_cells import compared, header
from biogrip.own_traces.outputs import in_own_units
from biogrip.own_traces.rows_of_sheets import cases_of
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import COLUMN_IN, FITTED, MEASURED, PAGE_IN, TARGET, figure
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads, the
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Column, Table
from biogrip.study.sheet import Cell
from biogrip.study.study import Study

DATA = "results/traces/compared/groups.json"
"""All that is said of cells and groups, as ``biogrip groups`` writes it."""


def _has_groups(study: Study) -> bool:
    return bool(study.cells)


@dataclass(frozen=True)
class GroupsToCompare:
    """Cells of a sheet with their groups."""

    sheet: str
    factor: str
    to_fit: list[CellToFit]
    groups: list[str]

    def cells(self) -> list[Cell]:
        """Return the cells, in the order of the sheet."""
        pairs = zip(self.to_fit, self.groups, strict=True)
        return [Cell(own.name, group, own.cell.rows) for own, group in pairs]


def compare(compared_cells: GroupsToCompare, batches: list[Path], data: Path) -> None:
    """Compare the groups of cells, and write what ``biogrip groups`` does."""
    cells = compared_cells.cells()
    rows = [trace.options for own in compared_cells.to_fit for trace in own.traces]
    cases = cases_of(rows)
    results = [
        read_cell(own, group)
        for own, group in zip(compared_cells.to_fit, compared_cells.groups, strict=True)
    ]
    try:
        said = compared(results, cells, compared_cells.sheet, cases[0].confidence)
    except BiogripError as error:
        # Other results of the sheet stand.
        names = ("groups", "differences", "rejected", "doubtful", "skipped")
        none: dict[str, Any] = {name: [] for name in names}
        more = {"cells": [], "differences_without_doubtful": [], "problem": str(error)}
        said = {**none, **more}
    common = header(rows[0], cases, compared_cells.factor)
    # Cells are rounded already, and are not rounded twice.
    found = rounded_numbers({**common, "table": compared_cells.sheet, **said})
    found["cells"] = said["cells"]
    read = cases[0].problem.instrument.read
    write_text(data, json.dumps(in_own_units(found, read), indent=1) + "\n")


def _to_compare(study: Study, _: Wildcards) -> GroupsToCompare:
    assert study.traces is not None
    groups = [cell.group for cell in study.cells]
    factor = study.group_factor or ""
    return GroupsToCompare(study.traces.sheet, factor, every_cell(study), groups)


def _jobs(plan: Plan) -> list[Wildcards]:
    return [{}] if plan.study.cells else []


GROUPS = Product(
    "compared_groups",
    {"data": DATA},
    compare,
    _to_compare,
    _jobs,
    message="Comparing the groups of cells",
    reads={
        "batches": Reads(lambda plan, _: [BATCHES.format(**job) for job in jobs_of_cells(plan)])
    },
    of_traces=True,
)


def populations(_: object, data: Path) -> Table:
    """Return the population of every quantity in every group."""
    found = json.loads(data.read_text(encoding="utf-8"))
    rows = [
        (
            *(own["group"], own["quantity"], own["unit"]),
            len(own["determined"]) + len(own["not_determined"]),
            *(len(own["determined"]), len(own["bounded"])),
            *(own.get(key) for key in ("median", "low", "high")),
            *(_times(own, key) for key in ("log_deviation", "low", "high")),
        )
        for own in found["groups"]
    ]
    caption = (
        f"Populations of cells by {found['by']}: median and spread (the factor of one standard "
        f"deviation) with {100 * found['confidence']:g} % limits, from the profiles of all cells "
        "whose fits are not rejected."
    )
    return Table(caption, _POPULATIONS, rows)


def _times(group: dict[str, Any], key: str) -> float | None:
    return exp(group["spread"][key]) if "spread" in group else None


_POPULATIONS = (
    Column("group", "Group"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("cells", "Cells"),
    Column("determined", "that determine it"),
    Column("bounded", "that bound it"),
    Column("median", "Median"),
    Column("low", "from"),
    Column("high", "to"),
    Column("spread_times", "Spread, times"),
    Column("spread_low_times", "from"),
    Column("spread_high_times", "to"),
)


def differences(_: object, data: Path) -> Table:
    """Return the differences of every quantity between each group and the first."""
    found = json.loads(data.read_text(encoding="utf-8"))
    rows = [
        (
            *(own["quantity"], own["group"], own["against"]),
            *(own[key] for key in ("ratio", "low", "high", "p", "adjusted_p")),
            *(own["by_ranks"][key] for key in ("ratio", "low", "high")),
            own["detectable_ratio"],
        )
        for own in found["differences"]
    ]
    caption = (
        f"Ratios of the medians of groups by {found['by']}, with "
        f"{100 * found['confidence']:g} % limits; p adjusted for the number of groups (Holm); the "
        "median ratio of two cells by ranks; and the smallest ratio that as many cells detect "
        "with 80 % power."
    )
    return Table(caption, _DIFFERENCES, rows)


_DIFFERENCES = (
    Column("quantity", "Quantity"),
    Column("group", "Group"),
    Column("against", "against"),
    Column("ratio", "Ratio"),
    Column("low", "from"),
    Column("high", "to"),
    Column("p", "p", 2),
    Column("adjusted_p", "adjusted", 2),
    Column("ranks_ratio", "by ranks"),
    Column("ranks_low", "from"),
    Column("ranks_high", "to"),
    Column("detectable_ratio", "Ratio found in 80 %"),
)


def draw_groups(_: object, data: Path) -> Figure:
    """Draw every cell with its limits, and the medians of groups, a panel a quantity."""
    found = json.loads(data.read_text(encoding="utf-8"))
    if not found["groups"]:
        drawn = figure(COLUMN_IN, 0.6)
        drawn.text(0.02, 0.5, "No cell can be compared.", va="center")
        return drawn
    names = list(dict.fromkeys(own["quantity"] for own in found["groups"]))
    order = list(dict.fromkeys(own["group"] for own in found["groups"]))
    symbols = {item["quantity"]: item["symbol"] for item in found["cells"][0]["quantities"]}
    rows = -(-len(names) // 2)
    drawn = figure(PAGE_IN if len(names) > 1 else COLUMN_IN, 0.5 + rows * (0.8 + 0.35 * len(order)))
    grid = drawn.subplots(rows, min(len(names), 2), squeeze=False).ravel()
    for axes in grid[len(names) :]:
        axes.set_axis_off()
    for axes, name in zip(grid, names, strict=False):
        of_quantity = [own for own in found["groups"] if own["quantity"] == name]
        axes.set_xscale("log")
        # Cells of one kind lie within a decade or two: plain numbers, not powers of ten.
        axes.xaxis.set_major_formatter(LogFormatter())
        axes.xaxis.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.5)))
        for own in of_quantity:
            _draw_group(axes, order.index(own["group"]), own, found["cells"])
        axes.set(
            yticks=range(len(order)),
            yticklabels=order,
            ylim=(len(order) - 0.5, -0.5),
            xlabel=with_unit(symbols[name], of_quantity[0]["unit"]),
        )
    return drawn


def _draw_group(axes: Axes, row: int, group: dict[str, Any], cells: list[dict[str, Any]]) -> None:
    """Draw the cells of a group with their limits, arrows where one is missing, and the median."""
    own = [
        (item, cell["fit"])
        for cell in cells
        if cell["group"] == group["group"] and cell["fit"] != "rejected"
        for item in cell["quantities"]
        if item["quantity"] == group["quantity"]
    ]
    bounded = [(item, fit) for item, fit in own if (item["low"], item["high"]) != (None, None)]
    for place, (item, fit) in enumerate(bounded):
        y = row - 0.35 + 0.5 * (place + 0.5) / len(bounded)
        low, high = item["low"], item["high"]
        face = MEASURED if fit == "ok" else "none"
        if low is not None and high is not None:
            axes.hlines(y, low, high, color=MEASURED, linewidth=0.8)
            axes.plot(item["value"], y, "o", color=MEASURED, markerfacecolor=face, markersize=2.5)
        else:
            end, marker = (high, "<") if low is None else (low, ">")
            axes.plot(end, y, marker, color=MEASURED, markerfacecolor=face, markersize=3)
    if "median" in group:
        axes.hlines(row + 0.3, group["low"], group["high"], color=FITTED, linewidth=2)
        axes.plot(group["median"], row + 0.3, "D", color=TARGET, markersize=4)


POPULATIONS = table(
    populations,
    name="groups",
    item="traces: groups",
    caption="Populations of cells in each group of the sheet: medians and spreads with limits.",
    reads={"data": the(DATA)},
    of_traces=True,
    when=_has_groups,
)

DIFFERENCES = table(
    differences,
    name="group_differences",
    item="traces: differences of groups",
    caption="Ratios of the medians of groups of the sheet, with limits, p values and power.",
    reads={"data": the(DATA)},
    of_traces=True,
    when=_has_groups,
)

FIGURE = drawing(
    draw_groups,
    name="groups_figure",
    file="groups",
    item="traces: groups",
    caption="Every cell of the sheet with its limits (dots; arrows where a trace sets one limit "
    "only; hollow where the fit is doubtful), and the medians of groups with theirs (diamonds).",
    reads={"data": the(DATA)},
    of_traces=True,
    when=_has_groups,
)
