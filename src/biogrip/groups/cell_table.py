"""Reader of the user's table that assigns traces to cells and cells to groups, CSV."""

import csv
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest
from biogrip.traces.columns import place

COLUMNS = ("file", "cell", "group")

_SEPARATORS = ",;\t"
_SHOWN = 100


@dataclass(frozen=True)
class Cell:
    """A cell and the files of its traces."""

    name: str
    """Name in the table."""
    group: str
    """Name of its group there."""
    traces: tuple[Path, ...]
    """Files of its recorded traces (replicates), sorted by path."""


@dataclass(frozen=True)
class _Row:
    line: int
    file: Path
    cell: str
    group: str


def read_cells(table: Path) -> list[Cell]:
    """Read a table of traces, cells and groups.

    The file is UTF-8 text with a header, separated by comma, semicolon or tab. Lines that are
    empty or start with ``#``, and other columns than `COLUMNS`, are ignored. Paths are relative
    to the table's folder. A cell on several lines has replicates.

    Parameters
    ----------
    table
        The file.

    Returns
    -------
    list of Cell
        Cells in the order of their first rows.

    Raises
    ------
    BiogripError
        If the file cannot be read as text, lacks a column or repeats it, a row has too few, too
        many or empty cells, a trace occurs twice, or a cell is in two groups.
    """
    try:
        text = table.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise BiogripError(
            f"{place(table)}: found bytes that are no UTF-8, allowed is text."
        ) from error
    except OSError as error:
        raise BiogripError(f"{place(table)}: cannot be read: {error.strerror}.") from error
    if "\0" in text:
        raise BiogripError(f"{place(table)}: found binary data, allowed is text.")
    rows = list(_rows(table, text))
    if not rows:
        raise BiogripError(
            f"{place(table)}: found no traces, allowed is a row for each below the header."
        )
    _refuse_repeated(table, rows)
    by_cell: dict[str, list[_Row]] = {}
    for row in rows:
        by_cell.setdefault(row.cell, []).append(row)
    return [_cell(table, own) for own in by_cell.values()]


def _rows(table: Path, text: str) -> Iterator[_Row]:
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise BiogripError(f"{place(table)}: found no header, allowed is {','.join(COLUMNS)}.")
    header_line, header = numbered[0]
    separator = max(_SEPARATORS, key=header.count)
    names = _split(table, header_line, header, separator)
    at = [_index(table, header_line, names, column) for column in COLUMNS]
    for line, content in numbered[1:]:
        cells = _split(table, line, content, separator)
        if len(cells) < len(names) or any(cells[len(names) :]):
            raise BiogripError(
                f"{place(table, line)}: found {counted(len(cells), 'cell')} in the row, "
                f"allowed are the header's {len(names)}."
            )
        file, cell, group = (cells[index] for index in at)
        for column, value in zip(COLUMNS, (file, cell, group), strict=True):
            if not value:
                raise BiogripError(
                    f"{place(table, line, column)}: found nothing, allowed is a name."
                )
        yield _Row(line, table.parent / file, cell, group)


def _split(table: Path, line: int, content: str, separator: str) -> list[str]:
    try:
        (cells,) = csv.reader([content], delimiter=separator, skipinitialspace=True, strict=True)
    except csv.Error as error:
        raise BiogripError(f"{place(table, line)}: cannot be read as a row: {error}.") from error
    return [cell.strip() for cell in cells]


def _index(table: Path, line: int, names: list[str], column: str) -> int:
    found = [index for index, name in enumerate(names) if name == column]
    if len(found) > 1:
        raise BiogripError(
            f"{place(table, line, column)}: found {len(found)} columns of this name, "
            "allowed is one."
        )
    if not found:
        shown = ", ".join(names)
        shown = shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
        raise BiogripError(
            f"{place(table, line, column)}: found no such column among {shown}; allowed is a "
            f"header with {', '.join(COLUMNS)}.{nearest(column, names)}"
        )
    return found[0]


def _refuse_repeated(table: Path, rows: list[_Row]) -> None:
    """Refuse a trace that is listed twice, since copies would count as agreeing replicates."""
    first: dict[str, int] = {}
    for row in rows:
        # Compare resolved paths, so that links are detected.
        if (before := first.setdefault(os.path.realpath(row.file), row.line)) != row.line:
            raise BiogripError(
                f"{place(table, row.line, 'file')}: found '{row.file}' again, as on line {before}; "
                "allowed is each trace once."
            )


def _cell(table: Path, rows: list[_Row]) -> Cell:
    first = rows[0]
    for row in rows[1:]:
        if row.group != first.group:
            raise BiogripError(
                f"{place(table, row.line, 'group')}: found '{row.group}' for the cell "
                f"'{row.cell}', which is of '{first.group}' on line {first.line}; allowed is one "
                "group for a cell, or another name of the cell."
            )
    return Cell(first.cell, first.group, tuple(sorted(row.file for row in rows)))
