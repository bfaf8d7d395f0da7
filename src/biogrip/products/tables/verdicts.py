"""Verdicts on one trace of a case, quantity by quantity."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.product import JUDGEMENT, the
from biogrip.products.stages.expected import verdicts_expected
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.study.study import Case, Study

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


@dataclass(frozen=True)
class Settings:
    """Name, title and true parameters of a case; parameters are empty if unknown."""

    case: str
    title: str
    parameters: Mapping[str, float]


def settings(study: Study, case: Case) -> Settings:
    """Return the settings that the table of a case depends on."""
    return Settings(case.name, case.title, case.parameters)


def verdicts(settings: Settings, measured: Path, expected: list[Path]) -> Table:
    """List the verdicts on all quantities of a case.

    Parameters
    ----------
    settings
        The case.
    measured
        Verdicts on the judged trace, JSON.
    expected
        Verdicts on the trace without noise, JSON, if the truth is known.
    """
    found, others = read_verdicts(measured), [read_verdicts(path) for path in expected]
    foreseen_of = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    rows: list[tuple[Cell, ...]] = []
    for item in found["quantities"]:
        name = item["quantity"]
        foreseen = foreseen_of.get(name, {})
        rows.append(
            (
                settings.case,
                name,
                item["unit"],
                target_of(name, settings.parameters),
                found["fit"],
                item["verdict"],
                item["value"] if item["verdict"] == "determined" else None,
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
        f"{settings.title}: verdicts on the trace of one seed, from profile likelihoods.{trades} "
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


VERDICTS = table(
    verdicts,
    name="verdicts",
    item="verdicts",
    caption="Verdicts on every quantity from profile likelihoods of one seed's trace, with "
    "confidence limits, beside those expected from the trace without noise.",
    settings=settings,
    reads={"measured": the(PATH), "expected": verdicts_expected()},
    cases=lambda study: study.cases,
    weight=JUDGEMENT,
)
