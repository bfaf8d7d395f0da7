"""Tables 5 to 7: target, the paper's identification and this study's; and all of them joined."""

from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.fit.methods import near_noise, near_noise_words, typical
from biogrip.physics.models import Truth
from biogrip.physics.sample_model import Parameter
from biogrip.records.identifications import read_identifications
from biogrip.records.rows import read_rows
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Cell, Column, Table

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
TYPICAL = (
    "Typical is the seed of median excess of the misfit over the noise in its trace; the lowest "
    "misfit would be that of the quietest trace."
)

_WHOLE_NUMBERS = {"typical_seed", "seeds"}


def table_columns(near_noise_tolerance: float) -> tuple[Column, ...]:
    """Return the columns of an error table."""
    share = f"Share {near_noise_words(near_noise_tolerance)}"
    return (*_COLUMNS, Column("near_noise_share", share, 2))


def errors_of_case(case: Case, identifications: Path) -> Table:
    """Compare target and identified values of one case, given its identifications, CSV."""
    truth = case.truth
    found = read_identifications(identifications, case.study.shown)
    shown = found.index.get_loc(typical(found).name)
    known = bool(found["noise_rms"].notna().all())
    reached = near_noise(found, case.study.near_noise_tolerance)
    share = float(np.mean(reached)) if known else None
    rows = []
    for names in truth.model.quantities:
        label = " + ".join(parameter.name for parameter in names)
        target = truth.target(names)
        values = found[[parameter.column for parameter in names]].sum(axis=1).to_numpy(float)
        error = error_percent(target, values)
        low, median, high = np.percentile(values, [5, 50, 95])
        rows.append(
            (
                case.name,
                label,
                names[0].unit,
                target,
                *_paper(truth, names, target),
                int(found["seed"].iloc[shown]),
                float(values[shown]),
                float(error[shown]),
                float(median),
                float(low),
                float(high),
                float(np.median(np.abs(error))),
                len(found),
                share,
            )
        )
    number = f"Table {truth.published.table}. " if truth.published.table is not None else ""
    seeds = counted(len(found), "seed")
    caption = (
        f"{number}{truth.title}: target and identified parameters over {seeds}. "
        f"{TYPICAL} Error = (target - identified) / target."
        if truth.parameters
        else f"{truth.title}: parameters identified in the recorded trace."
    )
    return Table(caption, table_columns(case.study.near_noise_tolerance), rows)


def error_percent(target: float | None, identified: Array) -> Array:
    """Return (target - identified) / target in percent; NaN if the target is zero or unknown."""
    if not target:
        return np.full_like(identified, np.nan)
    return 100 * (target - identified) / target


def errors(study: Study, tables: list[Path]) -> Table:
    """Join the error tables of all cases, CSV."""
    columns = table_columns(study.near_noise_tolerance)
    names = [column.name for column in columns]
    rows: list[tuple[Cell, ...]] = [
        tuple(_cell(name, text) for name, text in zip(names, row, strict=True))
        for path in tables
        for row in read_rows(path, names)[1:]
    ]
    caption = (
        f"Identification errors of all cases. {TYPICAL} Error = (target - identified) / target."
    )
    return Table(caption, columns, rows)


def _cell(name: str, text: str) -> Cell:
    if name in _WHOLE_NUMBERS:
        return int(text)
    try:
        return float(text)
    except ValueError:
        return text or None


def _paper(
    truth: Truth, quantity: list[Parameter], target: float | None
) -> tuple[float | None, str | float | None]:
    """Return the paper's value and error; the error of a sum is computed from its values."""
    identified, names = truth.published.identified, [p.name for p in quantity]
    if not all(name in identified for name in names):
        return None, None
    value = float(sum(identified[name] for name in names))
    if len(names) == 1:
        return value, truth.published.error_percent.get(names[0])
    return value, float(error_percent(target, np.array([value]))[0])


_CAPTION = (
    "Target values, the values and errors that the paper prints, and those of this study: the seed "
    "of median excess of the misfit over the noise in its trace, median and 5 to 95 % over seeds, "
    "the median absolute error, and the share of seeds whose misfit is within the study's "
    "tolerance of the noise. Errors are (target - identified) / target. Where c and c_p trade "
    "against each other, only the row c + c_p is determined."
)
