"""The error tables of all cases in one."""

from pathlib import Path

from biogrip.products.files.rows import read_rows
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.errors import CAPTION, ERRORS, TABLE_COLUMNS
from biogrip.products.tables.layout import Cell, Table

_WHOLE_NUMBERS = {"best_seed", "seeds"}


def all_errors(settings: None, tables: list[Path]) -> Table:
    """Join the error tables of the cases, CSV."""
    names = [column.name for column in TABLE_COLUMNS]
    rows: list[tuple[Cell, ...]] = [
        tuple(_cell(name, text) for name, text in zip(names, row, strict=True))
        for path in tables
        for row in read_rows(path, names)[1:]
    ]
    caption = (
        "Identification errors of all cases. Best is the seed of lowest misfit. "
        "Error = (target - identified) / target."
    )
    return Table(caption, TABLE_COLUMNS, rows)


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
    sheet="tables",
    settings=lambda study: None,
    reads={"tables": of_cases(ERRORS.writes["csv"], lambda study: study.cases)},
)
