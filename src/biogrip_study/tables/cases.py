"""What is found of each case, as in the paper's Tables 5 to 7, and verdicts on its quantities.

What the paper's printed values and errors leave of the numbers that it printed, `interval_of` says.
"""

from collections.abc import Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import biogrip_study.records.identifications as records
from biogrip.digits import counted
from biogrip.judging.likelihood import parameters_and_sum, quantity_value
from biogrip.judging.profiles import DETERMINED
from biogrip_study.config.study import Case, Study
from biogrip_study.tables.layout import Column, Row, ShownTable, titled

_QUANTILES = {"p05": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95}
_ERROR_COLUMNS = (
    *titled("case", "parameter", "unit"),
    Column("target", "Target", 4),
    Column("basin", "Runs that end"),
    Column("seeds", "Seeds"),
    *(
        Column(f"{name}_identified", "Median" if name == "median" else f"{100 * share:g} %", 3)
        for name, share in _QUANTILES.items()
    ),
    Column("median_error_percent", "Error of the median %", 2),
    Column("median_absolute_error_percent", "Median abs. error %", 2),
)
_BASINS = (
    "Runs that end near the noise of their trace and runs that end above it have rows of their own "
    "if a tenth or more end in each. Error = (target - identified) / target."
)


def _error_columns(study: Study) -> tuple[Column, ...]:
    share = f"Share {records.near_noise_words(study)}"
    ends = (Column(f"near_noise_{end}", f"95 % {end}", 2) for end in ("from", "to"))
    return (*_ERROR_COLUMNS, Column("near_noise_share", share, 2), *ends)


def errors_of_case(case: Case, identifications: Path) -> ShownTable:
    """Compare target and identified values of one case, given its identifications, CSV."""
    identified = records.read_identifications(identifications, case, case.study.shown_method.name)
    of_case: Row = {"case": case.name}
    if identified["noise_rms"].notna().all():
        near = records.share_with_limits(
            int(records.near_noise(identified, case.study).sum()), len(identified)
        )
        of_case |= zip((f"near_noise_{end}" for end in ("share", "from", "to")), near, strict=True)
    rows = []
    for basin, runs in ({records.ALL: identified} | records.basins(identified, case.study)).items():
        found = records.values_by_quantity(runs, case.sample.model)
        for quantity in parameters_and_sum(case.sample.model):
            values, target = found[quantity.label], quantity_value(quantity.label, case.parameters)
            of_quantity = {
                "parameter": quantity.label,
                "unit": quantity.unit,
                "target": target,
                "basin": basin,
                "seeds": len(runs),
                "median_error_percent": error_percent(target, values.median()),
                "median_absolute_error_percent": abs(error_percent(target, values)).median(),
            }
            for name, share in _QUANTILES.items():
                of_quantity[f"{name}_identified"] = values.quantile(share)
            rows.append(of_case | of_quantity)
    number = f"Table {case.published.table}. " if case.published.table is not None else ""
    caption = (
        f"{number}{case.title}: target and identified parameters over "
        f"{counted(len(identified), 'seed')}. {_BASINS}"
        if case.parameters
        else f"{case.title}: parameters identified in the recorded trace."
    )
    return ShownTable(caption, _error_columns(case.study), rows)


def error_percent(target: float | None, identified: Any) -> Any:
    """Return (target - identified) / target in percent, of one value or of several.

    NaN if the target is zero or unknown.
    """
    return 100 * (target - identified) / target if target else np.nan * identified


def errors(study: Study, identifications: list[Path]) -> ShownTable:
    """Join the tables of errors of all cases, given the identifications of each, CSV."""
    files = zip(study.cases.values(), identifications, strict=True)
    rows = [row for case, file in files for row in errors_of_case(case, file).rows]
    caption = f"Identification errors of all cases. {_BASINS}"
    return ShownTable(caption, _error_columns(study), rows)


def _verdict_columns(confidence: float) -> tuple[Column, ...]:
    percent = f"{100 * confidence:g} %"
    return (
        *titled("case", "quantity", "unit"),
        Column("target", "Target", 4),
        *titled("fit", "verdict"),
        Column("value", "Estimate", 3),
        Column("low", f"{percent} from", 3),
        Column("high", f"{percent} to", 3),
        Column("excluded", "Except"),
        Column("expected_verdict", "Expected verdict"),
        Column("expected_low", "Expected from", 3),
        Column("expected_high", "Expected to", 3),
    )


def verdicts_of_case(case: Case, verdicts: Path, expected: list[Path]) -> ShownTable:
    """List the verdicts on all quantities of a case, and those expected, where there are any."""
    judged, others = (
        records.read_verdicts(verdicts),
        [records.read_verdicts(path) for path in expected],
    )
    foreseen_of = {item["quantity"]: item for item in others[0]["quantities"]} if others else {}
    rows = []
    for item in judged["quantities"]:
        foreseen = foreseen_of.get(item["quantity"], {})
        gaps = " and ".join(f"{start:.3g} to {end:.3g}" for start, end in item["excluded"])
        rows.append(
            {name: item[name] for name in ("quantity", "unit", "verdict", "low", "high")}
            | {f"expected_{name}": foreseen.get(name) for name in ("verdict", "low", "high")}
            | {
                "case": case.name,
                "target": quantity_value(item["quantity"], case.parameters),
                "fit": judged["fit"],
                "value": item["value"] if item["verdict"] == DETERMINED else None,
                "excluded": gaps,
            }
        )
    trades = "".join(
        f" {' and '.join(trade['members'])} trade against each other: determined is "
        f"{trade['quantity']}."
        for trade in judged["trades"]
    )
    caption = (
        f"{case.title}: verdicts on the trace of one seed, from profile likelihoods.{trades} "
        f"One-sided limits hold with {50 * (1 + judged['confidence']):g} % confidence."
    )
    if others:
        caption += " Expected: the same for the trace without noise, judged at the noise level."
    return ShownTable(caption, _verdict_columns(judged["confidence"]), rows)


def interval_of(
    printed: float, target: float | None, error_percent: str | None
) -> tuple[float, float]:
    """Return the ends of the numbers that are printed so with this error, rounded or cut off.

    Without an error, or with one that is no number or that no such number has, the value alone
    counts.
    """
    values = _ways(Decimal(f"{printed:.15g}"))
    overlaps = []
    with suppress(InvalidOperation, TypeError):
        # The paper's signs differ; on which side a value lies it shows itself.
        errors = _ways(abs(Decimal(error_percent or "unknown")))
        true = Decimal(f"{target:.15g}" if target else "unknown")
        sign = -1 if printed < true else 1
        for value, error in product(values, errors):
            ends = sorted(true * (1 + sign * end / 100) for end in error)
            overlaps.append((max(value[0], ends[0]), min(value[1], ends[1])))
    held = [ends for ends in overlaps if ends[0] <= ends[1]] or values
    return float(min(low for low, _ in held)), float(max(high for _, high in held))


def value_in_case(case: Case, names: Sequence[str]) -> tuple[float, float, float] | None:
    """Return the paper's value of a parameter or of a sum, and its interval; None if it has none.

    The value is the printed one if it has the printed error, else the middle of the interval.
    """
    told = case.published
    if not all(name in told.identified for name in names):
        return None
    members = []
    for name in names:
        printed, target = told.identified[name], case.parameters.get(name)
        low, high = interval_of(printed, target, told.error_percent.get(name))
        members.append((printed if low <= printed <= high else (low + high) / 2, low, high))
    value, low, high = np.sum(members, axis=0).tolist()
    return value, low, high


def _ways(printed: Decimal) -> list[tuple[Decimal, Decimal]]:
    """Return the numbers that are printed so if they are rounded, and if they are cut off."""
    step = Decimal(1).scaleb(int(printed.as_tuple().exponent))
    cut = (printed if printed else printed - step, printed + step)
    return [(printed - step / 2, printed + step / 2), cut]
