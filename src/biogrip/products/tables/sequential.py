"""Number of experiments until parameters of simulated cells are known, by way of planning."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import BoolArray
from biogrip.products.designed_cases import WELL
from biogrip.products.files.sequences import SEQUENCES
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Reads
from biogrip.products.stages.sequence import AFTER, BEFOREHAND, REPEATED, TRUTH, cells_of, sequenced
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.products.uses import each, from_study
from biogrip.study.study import Study

IN_WORDS: Mapping[str, str] = {
    REPEATED: "the study's, repeated",
    AFTER: "each designed after those before",
    BEFOREHAND: "designed for the ranges, repeated",
    TRUTH: "designed for the true cell, repeated",
}
"""Ways of planning, in print."""

ALL = "all"

_COLUMNS = (
    Column("case", "Case"),
    Column("way", "Experiments"),
    Column("experiments", "How many"),
    Column("quantity", "Quantity"),
    Column("cells", "Cells"),
    Column("determined_percent", f"Known to {100 * WELL:g} % in % of cells"),
    Column("half_width_percent", "Half of the interval, median %", 2),
    Column("error_percent", "Error, median %", 2),
    Column("coverage_percent", "Intervals that hold the truth %"),
    Column("missed_percent", "Best fit missed %"),
    Column("pressed_percent", "Jaws press throughout %"),
)


def sequential(study: Study, rows: list[Path]) -> Table:
    """Compute how well cells are known after each number of experiments."""
    found = pd.concat([SEQUENCES.read(file) for file in rows])
    lines = [line for case in study.cases for line in _lines(case, found[found["case"] == case])]
    levels = [case.confidence for case in study.cases.values()]
    confidence = " or ".join(sorted({f"{100 * level:g}" for level in levels}))
    caption = (
        "Simulated cells, drawn from the ranges of the design, with one experiment after another; "
        "all traces of a cell are fitted together, with the arms' inertia, all parameters free and "
        "the noise known. The study's experiment again and again; that one first, and each next "
        "one designed from what all before told; one designed for all cells of the ranges, and one "
        "for the true values, again and again. A quantity counts as known where its interval of "
        f"{confidence} %, from the profile likelihood, has two ends and is no wider than "
        f"{100 * WELL:g} % to each side; all are where each of them is. Intervals with one end "
        "count, too, among those that hold the truth. A best fit is missed if a fit from the "
        "truth has a lower chi-squared."
    )
    return Table(caption, _COLUMNS, lines)


def half_widths(found: pd.DataFrame) -> "pd.Series[float]":
    """Return half of each interval as a share of its middle; infinite with an open end."""
    return (0.5 * np.log(found["high"] / found["low"])).fillna(np.inf).map(np.expm1)


def known_well(found: pd.DataFrame) -> BoolArray:
    """Return True for each row whose interval is narrow enough to count as determined."""
    return (half_widths(found) <= WELL).to_numpy()


def _lines(case: str, found: pd.DataFrame) -> list[tuple[Cell, ...]]:
    found = found.assign(
        well=known_well(found),
        half=half_widths(found),
        error=(found["estimate"] / found["truth"] - 1).abs(),
    )
    low, high = found["low"].fillna(0.0), found["high"].fillna(np.inf)
    found = found.assign(held=(low <= found["truth"]) & (found["truth"] <= high))
    lines: list[tuple[Cell, ...]] = []
    for (way, count), some in found.groupby(["way", "experiments"], sort=False):
        head = case, IN_WORDS[way], int(count)
        for quantity, own in some.groupby("quantity", sort=False):
            typical = [own["well"].mean(), own["half"].median(), own["error"].median()]
            shares = map(_percent, [*typical, own["held"].mean()])
            lines.append((*head, str(quantity), len(own), *shares, None, None))
        cells = some.groupby("cell")
        worst = [cells["well"].all().mean(), *(cells[n].max().median() for n in ("half", "error"))]
        flags = [cells[name].first().mean() for name in ("missed", "pressed")]
        shares = map(_percent, [*worst, some["held"].mean(), *flags])
        lines.append((*head, ALL, len(cells), *shares))
    return lines


def _percent(share: float) -> Cell:
    return 100 * float(share) if np.isfinite(share) else None


def files_of(plan: Plan, case: str) -> list[str]:
    """Return the files of a case's cells."""
    cells = range(cells_of(plan.study.cases[case]))
    return [SEQUENCES.path.format(case=case, seed=cell) for cell in cells]


def _every_file(plan: Plan, _: Wildcards) -> list[str]:
    return [file for case in sequenced(plan.study) for file in files_of(plan, case)]


SEQUENTIAL = table(
    sequential,
    item="sequential experiments",
    caption="Accuracy of simulated cells' parameters over the number of experiments: the study's "
    "experiment repeated, or each experiment designed from all earlier traces.",
    uses=from_study(cases=each(sequenced, "confidence", cells=cells_of)),
    reads={"rows": Reads(_every_file)},
    when=sequenced,
)
