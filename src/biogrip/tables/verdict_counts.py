"""Counts of the verdicts of whole profiles on each quantity, and of the true ones."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, NOT_DETERMINED, WIDE
from biogrip.records.intervals import INTERVALS
from biogrip.study.study import Study
from biogrip.tables.coverage import holds
from biogrip.tables.layout import Cell, Column, Table
from biogrip.tables.verdicts import target_of

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("verdict", "Verdict"),
    Column("seeds", "Seeds"),
    Column("reached", "With this verdict"),
    *(Column(f"reached_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
    Column("narrow", f"Within a factor of {WIDE:g}"),
    Column("true", "True"),
    Column("true_percent", "True %"),
    *(Column(f"true_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
)


def verdict_counts(study: Study, intervals: list[Path]) -> Table:
    """Count verdicts of whole profiles, and those whose limits hold the true value."""
    rows: list[tuple[Cell, ...]] = []
    estimated = pd.concat([INTERVALS.read(file) for file in intervals])
    for name, case in study.cases.items():
        found = estimated[estimated["case"] == name]
        for quantity in parameters_and_sum(case.problem.searched):
            mine = found[(found["quantity"] == quantity.label) & found["verdict"].notna()]
            truth = target_of(quantity.label, case.parameters)
            rows += [(name, *row) for row in _rows(quantity, mine, truth)]
    percents = " or ".join(sorted({f"{100 * case.confidence:g}" for case in study.cases.values()}))
    caption = (
        f"Verdicts from whole profiles at {percents} %, as users are shown them, in every seed: "
        "how often each is reached, with the 95 % interval of its share, and how often its limits "
        "hold the true value, with the 95 % interval of that share (Clopper and Pearson)."
    )
    return Table(caption, _COLUMNS, rows)


def _rows(
    quantity: Quantity, found: pd.DataFrame, truth: float | None
) -> Iterator[tuple[Cell, ...]]:
    for verdict, mine in found.groupby("verdict"):
        count = len(mine)
        head = (quantity.label, quantity.unit, truth, str(verdict), len(found), count)
        narrow: int | None = None
        if verdict == DETERMINED:
            narrow = int(np.sum(mine["shown_high"] <= WIDE**2 * mine["shown_low"]))
        true: tuple[Cell, ...] = (None,) * 4
        if verdict != NOT_DETERMINED and truth is not None:
            held = int(np.sum(holds(mine, truth, "shown_")))
            true = held, 100 * held / count, *_interval_percent(held, count)
        yield *head, *_interval_percent(count, len(found)), narrow, *true


def _interval_percent(count: int, tried: int) -> tuple[float, float]:
    """Return the 95 % interval of Clopper and Pearson for a share, in percent."""
    from scipy.stats import binomtest

    low, high = binomtest(count, tried).proportion_ci(0.95, method="exact")
    return 100 * low, 100 * high
