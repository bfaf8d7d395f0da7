"""Rows of numbers below a header."""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.traces.cells import number_or_inf
from biogrip.traces.columns import place, shortened

MOST_ROWS = 10_000_000

_ROWS_AT_ONCE = 100_000


@dataclass(frozen=True)
class Layout:
    """Layout of rows, as their header tells it."""

    separator: str
    """Cell separator."""
    width: int
    """Number of columns."""
    indices: dict[str, int]
    """Indices of the columns to read by name, in the order of reading."""


def read_rows(
    path: Path, numbered: Iterable[tuple[int, str]], layout: Layout
) -> tuple[Array, IntArray]:
    """Return numbers, (n_rows, n_columns), NaN for gaps, and line numbers, (n_rows,).

    Parameters
    ----------
    path
        The file, for messages.
    numbered
        Line numbers and lines.
    layout
        Columns to read.

    Raises
    ------
    BiogripError
        If a row has too few or too many cells, or text that is neither a finite number nor a gap,
        or there are more than `MOST_ROWS`.
    """
    values, row_lines = [np.zeros((0, len(layout.indices)))], [np.zeros(0, np.int64)]
    for at, rows in _batches(path, numbered, layout.separator):
        _check_rows(path, at, rows, layout)
        cells = {name: [row[i] for row in rows] for name, i in layout.indices.items()}
        numbers = [_numbers(path, at, name, cells[name], layout.separator) for name in cells]
        values.append(np.stack(numbers, axis=1))
        row_lines.append(np.array(at))
    return np.concatenate(values), np.concatenate(row_lines)


def _batches(
    path: Path, numbered: Iterable[tuple[int, str]], separator: str
) -> Iterator[tuple[list[int], list[list[str]]]]:
    """Yield line numbers and rows, some at a time."""
    at: list[int] = []

    def lines() -> Iterator[str]:
        for number, line in numbered:
            at.append(number)
            yield line

    reader = csv.reader(lines(), delimiter=separator, skipinitialspace=True)
    count = 0
    while True:
        at.clear()
        rows = list(islice(_one_per_line(path, reader, at), _ROWS_AT_ONCE))
        count += len(rows)
        check_row_count(path, count)
        if not rows:
            return
        yield at, rows


def check_row_count(path: Path, count: int) -> None:
    """Refuse more than `MOST_ROWS`."""
    if count > MOST_ROWS:
        raise BiogripError(f"{place(path)}: found over {MOST_ROWS} rows, allowed are {MOST_ROWS}.")


def _one_per_line(path: Path, reader: Iterator[list[str]], at: list[int]) -> Iterator[list[str]]:
    """Yield rows, refusing cells that span lines.

    If cells could span lines, an unclosed quote would swallow the rest of the file.
    """
    try:
        for count, row in enumerate(reader, 1):
            if len(at) != count:
                raise BiogripError(
                    f"{place(path, at[count - 1])}: found a quote without its end, "
                    "allowed are quoted cells that end on their line."
                )
            yield row
    except csv.Error as error:
        raise BiogripError(f"{place(path, at[-1])}: cannot be read as a row: {error}.") from error


def _check_rows(path: Path, at: list[int], rows: list[list[str]], layout: Layout) -> None:
    """Refuse rows that lack a wanted column, or have more cells than the header."""
    for line, row in zip(at, rows, strict=True):
        if len(row) == layout.width:
            continue
        for column, index in layout.indices.items():
            if len(row) <= index:
                raise BiogripError(
                    f"{place(path, line, column)}: found only {counted(len(row), 'cell')} in the "
                    f"row, allowed are the header's {layout.width}."
                )
        # Ignore empty cells at the end, since a trailing separator is common.
        if any(cell.strip() for cell in row[layout.width :]):
            raise BiogripError(
                f"{place(path, line)}: found {counted(len(row), 'cell')} in the row, allowed "
                f"are the header's {layout.width}. A decimal comma needs semicolons or "
                "tabs as separators."
            )


def _numbers(path: Path, at: list[int], column: str, cells: list[str], separator: str) -> Array:
    """Return cells as numbers, (n_rows,), with NaN for gaps."""
    texts = cells if separator == "," else [cell.replace(",", ".") for cell in cells]
    try:
        # Python reads 1_000 as a number; in a table it is damage.
        values = np.array(texts, dtype=float) if not any("_" in t for t in texts) else None
    except ValueError:
        values = None
    if values is None:
        values = np.array([number_or_inf(text) for text in texts])
    for row in np.flatnonzero(np.isinf(values))[:1]:
        raise BiogripError(
            f"{place(path, at[row], column)}: found '{shortened(cells[row])}', allowed is a "
            "finite number, or nan, NA, N/A, - or nothing where there is none."
        )
    return values
