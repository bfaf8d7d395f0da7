"""Verdicts on one trace of a case, quantity by quantity."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from biogrip.judging.verdicts import DETERMINED
from biogrip.records.verdicts import read_verdicts
from biogrip.study.study import Case
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
