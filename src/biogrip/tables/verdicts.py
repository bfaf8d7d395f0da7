"""Verdicts on one trace of a case, quantity by quantity.

Counts of the verdicts of whole profiles on each quantity, and of the true ones.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, NOT_DETERMINED, WIDE
from biogrip.records.identifications import INTERVALS, read_verdicts
from biogrip.study.study import Case, Study
from biogrip.tables.coverage import holds
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("fit", "Fit"),
    Column("verdict", "Verdict"),
    Column("value", "Estimate", 3),
    Column("low", "{percent} from", 3),
    Column("high", "{percent} to", 3),
    Column("excluded", "Except"),
    Column("expected_verdict", "Expected verdict"),
    Column("expected_low", "Expected from", 3),
    Column("expected_high", "Expected to", 3),
)


def verdicts(case: Case, measured: Path, expected: list[Path]) -> Table:
    """List the verdicts on all quantities of a case."""
    found, others = read_verdicts(measured), [read_verdicts(path) for path in expected]
    foreseen_of = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    rows: list[tuple[Cell, ...]] = []
    for item in found["quantities"]:
        name = item["quantity"]
        foreseen = foreseen_of.get(name, {})
        rows.append(
            (
                case.name,
                name,
                item["unit"],
                target_of(name, case.parameters),
                found["fit"],
                item["verdict"],
                item["value"] if item["verdict"] == DETERMINED else None,
                item["low"],
                item["high"],
                " and ".join(f"{start:.3g} to {end:.3g}" for start, end in item["excluded"]),
                foreseen.get("verdict"),
                foreseen.get("low"),
                foreseen.get("high"),
            )
        )
    trades = "".join(
        f" {' and '.join(trade['members'])} trade against each other: determined is "
        f"{trade['quantity']}."
        for trade in found["trades"]
    )
    caption = (
        f"{case.title}: verdicts on the trace of one seed, from profile likelihoods.{trades} "
        f"One-sided limits hold with {50 * (1 + found['confidence']):g} % confidence."
    )
    if others:
        caption += " Expected: the same for the trace without noise, judged at the noise level."
    percent = f"{100 * found['confidence']:g} %"
    columns = tuple(replace(c, heading=c.heading.format(percent=percent)) for c in _COLUMNS)
    return Table(caption, columns, rows)


def target_of(quantity: str, parameters: Mapping[str, float]) -> float | None:
    """Return the true value of a parameter or a sum, None if unknown."""
    names = quantity.split(" + ")
    return sum(parameters[name] for name in names) if set(names) <= set(parameters) else None


_COUNT_COLUMNS = (
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
    return Table(caption, _COUNT_COLUMNS, rows)


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
