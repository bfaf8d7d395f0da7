"""Tables 5 to 7: target, the paper's identification and this study's; and all of them joined."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.fit.methods import near_noise, near_noise_words, typical
from biogrip.physics.models import Truth
from biogrip.records.identifications import read_identifications
from biogrip.records.rows import read_rows
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Column, Row, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("paper_identified", "Paper", 4),
    Column("paper_error_percent", "Paper error %", 2),
    Column("typical_seed", "Typical seed"),
    Column("typical_identified", "Typical", 3),
    Column("typical_error_percent", "Typical error %", 2),
    Column("median_identified", "Median", 3),
    Column("p05_identified", "5 %", 3),
    Column("p95_identified", "95 %", 3),
    Column("median_absolute_error_percent", "Median abs. error %", 2),
    Column("seeds", "Seeds"),
)
_TYPICAL = (
    "Typical is the seed of median excess of the misfit over the noise in its trace; the lowest "
    "misfit would be that of the quietest trace. Error = (target - identified) / target."
)


def _columns(near_noise_tolerance: float) -> tuple[Column, ...]:
    share = f"Share {near_noise_words(near_noise_tolerance)}"
    return (*_COLUMNS, Column("near_noise_share", share, 2))


def errors_of_case(case: Case, identifications: Path) -> Table:
    """Compare target and identified values of one case, given its identifications, CSV."""
    truth, tolerance = case.truth, case.study.near_noise_tolerance
    found = read_identifications(identifications, case.study.shown)
    shown = found.index.get_loc(typical(found).name)
    known = found["noise_rms"].notna().all()
    of_case = {
        "case": case.name,
        "typical_seed": found["seed"].iloc[shown],
        "seeds": len(found),
        "near_noise_share": np.mean(near_noise(found, tolerance)) if known else None,
    }
    rows = []
    for quantity in truth.model.quantities:
        names = [parameter.name for parameter in quantity]
        target = truth.target(quantity)
        values = found[[parameter.column for parameter in quantity]].sum(axis=1).to_numpy(float)
        error = error_percent(target, values)
        low, median, high = np.percentile(values, [5, 50, 95])
        of_quantity = {
            "parameter": " + ".join(names),
            "unit": quantity[0].unit,
            "target": target,
            "typical_identified": values[shown],
            "typical_error_percent": error[shown],
            "median_identified": median,
            "p05_identified": low,
            "p95_identified": high,
            "median_absolute_error_percent": np.median(np.abs(error)),
        }
        rows.append(of_case | of_quantity | _of_paper(truth, names, target))
    number = f"Table {truth.published.table}. " if truth.published.table is not None else ""
    caption = (
        f"{number}{truth.title}: target and identified parameters over "
        f"{counted(len(found), 'seed')}. {_TYPICAL}"
        if truth.parameters
        else f"{truth.title}: parameters identified in the recorded trace."
    )
    return Table(caption, _columns(tolerance), rows)


def error_percent(target: float | None, identified: Array) -> Array:
    """Return (target - identified) / target in percent; NaN if the target is zero or unknown."""
    if not target:
        return np.full_like(identified, np.nan)
    return 100 * (target - identified) / target


def _of_paper(truth: Truth, names: list[str], target: float | None) -> Row:
    """Return the paper's value and error; the error of a sum is computed from its values."""
    identified = truth.published.identified
    if not all(name in identified for name in names):
        return {}
    value = float(sum(identified[name] for name in names))
    error: Any = truth.published.error_percent.get(names[0])
    if len(names) > 1:
        error = error_percent(target, np.array([value]))[0]
    return {"paper_identified": value, "paper_error_percent": error}


def errors(study: Study, tables: list[Path]) -> Table:
    """Join the error tables of all cases, CSV."""
    columns = _columns(study.near_noise_tolerance)
    names = [column.name for column in columns]
    rows = [
        {name: _cell(name, text) for name, text in zip(names, row, strict=True)}
        for path in tables
        for row in read_rows(path, names)[1:]
    ]
    return Table(f"Identification errors of all cases. {_TYPICAL}", columns, rows)


def _cell(name: str, text: str) -> str | float:
    if name in ("typical_seed", "seeds"):
        return int(text)
    try:
        return float(text)
    except ValueError:
        # As ">100", which the paper prints for an error.
        return text
