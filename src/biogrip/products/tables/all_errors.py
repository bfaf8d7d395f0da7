"""Error tables of all cases, joined."""

from pathlib import Path

from biogrip.products.files.rows import read_rows
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.errors import CAPTION, ERRORS, TYPICAL, table_columns
from biogrip.products.tables.layout import Cell, Table

_WHOLE_NUMBERS = {"typical_seed", "seeds"}


def all_errors(near_noise_tolerance: float, tables: list[Path]) -> Table:
    """Join the error tables of all cases, CSV."""
    columns = table_columns(near_noise_tolerance)
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


ALL_ERRORS = table(
    all_errors,
    name="all_errors",
    stem="results/tables/errors",
    item="errors",
    caption=CAPTION,
    settings=lambda study: study.near_noise_tolerance,
    reads={"tables": of_cases(ERRORS.writes["csv"], lambda study: study.cases)},
)
