"""Text of a sheet: header and rows of cells, separated by comma, semicolon or tab."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest
from biogrip.study.trace_file import trace_file_problem
from biogrip.traces.cells import SEPARATORS, cells_or_none
from biogrip.traces.columns import listed, place

FILE, CELL = "file", "cell"
"""The column that every sheet has, and that of the names of cells."""

# Bytes in which the header of a sheet is looked for.
_HEAD = 100_000


@dataclass(frozen=True)
class Line:
    """A row as text."""

    number: int
    """Line in the file, from 1."""
    cells: dict[str, str] = field(default_factory=dict)
    """Cells by the name of their column."""
    problem: str | None = None
    """What is wrong with the row as such, with its place."""


@dataclass(frozen=True)
class Table:
    """A header and rows."""

    path: Path
    """The file."""
    header_line: int
    """Line of the header, from 1."""
    names: list[str]
    """Names of the columns, each once."""
    lines: list[Line]
    """The rows."""


def is_sheet(path: Path) -> bool:
    """Return True if a file is a sheet: its header, of any table the first line, has ``file``."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        text = stream.read(_HEAD).decode("utf-8-sig", errors="replace")
    first = next((line for _, line in _significant(text)), "")
    # Another spelling, as File, is a sheet, too, whose reader says what is wrong.
    return any(name.lower() == FILE for each in SEPARATORS for name in cells_or_none(first, each))


def read_table(path: Path) -> Table:
    """Read a sheet as text.

    Raises
    ------
    BiogripError
        If it is no file, cannot be read as text, or has no rows, no column ``file`` or two columns
        of a name.
    """
    if problem := trace_file_problem(path):
        raise BiogripError(f"{place(path)}: {problem}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise BiogripError(
            f"{place(path)}: found bytes that are no UTF-8, allowed is text."
        ) from error
    except OSError as error:
        raise BiogripError(f"{place(path)}: cannot be read: {error.strerror}.") from error
    if "\0" in text:
        raise BiogripError(f"{place(path)}: found binary data, allowed is text.")
    numbered = list(_significant(text))
    if not numbered:
        raise BiogripError(f"{place(path)}: found no header, allowed is one with '{FILE}'.")
    header_line, header = numbered[0]
    separator = max(SEPARATORS, key=header.count)
    names = _header(path, header_line, header, separator)
    if len(numbered) == 1:
        raise BiogripError(
            f"{place(path)}: found no traces, allowed is a row for each below the header."
        )
    lines = [_line(path, names, number, line, separator) for number, line in numbered[1:]]
    return Table(path, header_line, [name for name in names if name], lines)


def _significant(text: str) -> Iterator[tuple[int, str]]:
    """Yield numbers of lines that are neither empty nor comments, and the lines."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def _header(path: Path, line: int, header: str, separator: str) -> list[str]:
    try:
        names = _split(header, separator)
    except csv.Error as error:
        raise BiogripError(f"{place(path, line)}: cannot be read as a row: {error}.") from error
    for name in filter(None, names):
        if (count := names.count(name)) > 1:
            raise BiogripError(
                f"{place(path, line, name)}: found {count} columns of this name, allowed is one."
            )
    if FILE not in names:
        raise BiogripError(
            f"{place(path, line, FILE)}: found no such column among {listed(names)}; allowed is a "
            f"header with {FILE}.{nearest(FILE, names)}"
        )
    return names


def _line(path: Path, names: list[str], number: int, line: str, separator: str) -> Line:
    try:
        cells = _split(line, separator)
    except csv.Error as error:
        text = f"{place(path, number)}: cannot be read as a row: {error}."
        return Line(number, problem=text)
    if len(cells) < len(names) or any(cells[len(names) :]):
        return Line(
            number,
            problem=f"{place(path, number)}: found {counted(len(cells), 'cell')} in the row, "
            f"allowed are the header's {len(names)}.",
        )
    # Columns without a name, as of a separator at the end of all lines, are no factors.
    return Line(number, {name: cell for name, cell in zip(names, cells, strict=False) if name})


def _split(line: str, separator: str) -> list[str]:
    (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True)
    return [cell.strip() for cell in cells]
