"""Error tables of all cases, joined."""

from pathlib import Path

from biogrip.products.files.rows import read_rows
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.errors_of_case import CAPTION, ERRORS_OF_CASE, TYPICAL, table_columns
from biogrip.products.tables.layout import Cell, Table
from biogrip.products.uses import every, from_study
from biogrip.study.study import Study

_WHOLE_NUMBERS = {"typical_seed", "seeds"}


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


ERRORS = table(
    errors,
    caption=CAPTION,
    uses=from_study("near_noise_tolerance"),
    reads={"tables": of_cases(ERRORS_OF_CASE.writes["csv"], every)},
)
