"""Verdicts on one trace of a case, quantity by quantity; and counts of verdicts over seeds."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, NOT_DETERMINED, WIDE
from biogrip.records.identifications import INTERVALS, read_verdicts
from biogrip.study.study import Case, Study
from biogrip.tables.coverage import holds
from biogrip.tables.layout import Column, Row, Table

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
    """List the verdicts on all quantities of a case, and those expected, where there are any."""
    found, others = read_verdicts(measured), [read_verdicts(path) for path in expected]
    foreseen_of = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    rows = []
    for item in found["quantities"]:
        foreseen = foreseen_of.get(item["quantity"], {})
        gaps = " and ".join(f"{start:.3g} to {end:.3g}" for start, end in item["excluded"])
        rows.append(
            {name: item[name] for name in ("quantity", "unit", "verdict", "low", "high")}
            | {f"expected_{name}": foreseen.get(name) for name in ("verdict", "low", "high")}
            | {
                "case": case.name,
                "target": target_of(item["quantity"], case.parameters),
                "fit": found["fit"],
                "value": item["value"] if item["verdict"] == DETERMINED else None,
                "excluded": gaps,
            }
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
    rows: list[Row] = []
    estimated = pd.concat([INTERVALS.read(file) for file in intervals])
    for name, case in study.cases.items():
        found = estimated[estimated["case"] == name]
        for quantity in parameters_and_sum(case.problem.searched):
            mine = found[(found["quantity"] == quantity.label) & found["verdict"].notna()]
            target = target_of(quantity.label, case.parameters)
            head: Row = {"case": name, "quantity": quantity.label, "unit": quantity.unit}
            rows += [head | row for row in _counts(mine, target)]
    percents = " or ".join(sorted({f"{100 * case.confidence:g}" for case in study.cases.values()}))
    caption = (
        f"Verdicts from whole profiles at {percents} %, as users are shown them, in every seed: "
        "how often each is reached, with the 95 % interval of its share, and how often its limits "
        "hold the true value, with the 95 % interval of that share (Clopper and Pearson)."
    )
    return Table(caption, _COUNT_COLUMNS, rows)


def _counts(found: pd.DataFrame, target: float | None) -> Iterator[Row]:
    """Yield a row for every verdict on a quantity."""
    for verdict, mine in found.groupby("verdict"):
        count = len(mine)
        row: Row = {"target": target, "verdict": verdict, "seeds": len(found), "reached": count}
        row |= _interval("reached", count, len(found))
        if verdict == DETERMINED:
            row["narrow"] = np.sum(mine["shown_high"] <= WIDE**2 * mine["shown_low"])
        if verdict != NOT_DETERMINED and target is not None:
            true = int(np.sum(holds(mine, target, "shown_")))
            row |= {"true": true, "true_percent": 100 * true / count}
            row |= _interval("true", true, count)
        yield row


def _interval(name: str, count: int, tried: int) -> Row:
    """Return the 95 % interval of Clopper and Pearson for a share, in percent."""
    low, high = binomtest(count, tried).proportion_ci(0.95, method="exact")
    return {f"{name}_from_percent": 100 * low, f"{name}_to_percent": 100 * high}
