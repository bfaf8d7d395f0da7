"""What one trace of a case tells, quantity by quantity."""

from pathlib import Path
from typing import Any

from biogrip.identifiability.document import read_verdicts
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("verdict", "Verdict"),
    Column("value", "Estimate", 3),
    Column("low", "95 % from", 3),
    Column("high", "95 % to", 3),
    Column("expected_verdict", "Expected verdict"),
    Column("expected_low", "Expected from", 3),
    Column("expected_high", "Expected to", 3),
)


def verdicts(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """List the verdicts on all quantities of a case.

    Parameters
    ----------
    settings
        ``case``, ``title``, ``parameters`` (the true ones, empty if unknown).
    inputs
        Verdicts on its trace, JSON; and what its traces should tell, JSON, if
        the truth is known.
    """
    found, *others = (read_verdicts(path) for path in inputs)
    expected = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    rows: list[tuple[Cell, ...]] = []
    for item in found["quantities"]:
        name = item["quantity"]
        foreseen = expected.get(name, {})
        rows.append(
            (
                settings["case"],
                name,
                item["unit"],
                _target(name, settings["parameters"]),
                item["verdict"],
                item["value"] if item["verdict"] == "determined" else None,
                item["low"],
                item["high"],
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
        f"{settings['title']}: what the trace of one seed tells, from profile likelihoods.{trades}"
    )
    if others:
        caption += " Expected: the same of the trace without noise, held against its noise."
    return Table(caption, _COLUMNS, rows)


def _target(quantity: str, parameters: dict[str, float]) -> float | None:
    names = quantity.split(" + ")
    return sum(parameters[name] for name in names) if set(names) <= set(parameters) else None
