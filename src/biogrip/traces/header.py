"""Header of a table: its separator, its names, and which of them are to be read."""

import csv
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.traces.cells import SEPARATORS, count_numbers, split
from biogrip.traces.columns import Columns, listed, place
from biogrip.traces.rows import Layout
from biogrip.traces.units import plain_name

# Lines among which a header is looked for, where the first has not the columns.
_LONGEST_PREAMBLE = 200


def split_header(path: Path, at: int, line: str, needed: Sequence[str]) -> tuple[str, list[str]]:
    """Return the separator that yields most wanted columns, then most columns, and the names.

    Raises
    ------
    BiogripError
        If the line cannot be read as a row.
    """
    try:
        readings = {separator: split(line, separator) for separator in SEPARATORS}
    except csv.Error as error:
        raise BiogripError(f"{place(path, at)}: cannot be read as a row: {error}.") from error
    plain = {plain_name(name) for name in needed}

    def merit(separator: str) -> tuple[int, int]:
        names = readings[separator]
        return len(plain & set(map(plain_name, names))), len(names)

    separator = max(readings, key=merit)
    return separator, readings[separator]


def has_columns(names: Sequence[str], columns: Columns) -> bool:
    """Return True if names of a header include all columns to read."""
    return {*map(plain_name, columns.named.values())} <= {*map(plain_name, names)}


def layout_of(path: Path, at: int, separator: str, names: list[str], columns: Columns) -> Layout:
    """Return where the columns to read are.

    Raises
    ------
    BiogripError
        If one is missing or repeated, or two are the same.
    """
    needed = columns.named
    which = columns.said_by(*needed)
    indices = [_index(path, at, names, column, which) for column in needed.values()]
    for (one, i), (other, j) in combinations(zip(needed, indices, strict=True), 2):
        if i == j:
            raise BiogripError(
                f"{place(path, at, needed[one])}: found {one} and {other} in one column, "
                "allowed are two."
            )
    return Layout(separator, len(names), dict(zip(needed.values(), indices, strict=True)))


def hint_on_header(path: Path, lines: Sequence[tuple[int, str]], columns: Columns) -> str:
    """Return a hint on the first line that has numbers below its names."""
    first = lines[: _LONGEST_PREAMBLE + 1]
    rows = [split_header(path, *line, [*columns.named.values()])[1] for line in first]
    for (line, _), names, below in zip(first, rows, [*rows[1:], []], strict=True):
        if len(names) == len(below) > 1 and count_numbers(below) > count_numbers(names) == 0:
            how = f"--skip {line - 1}" if columns.by_options else f"skip: {line - 1} there"
            return f" Line {line} looks like the header: {how}." if line > first[0][0] else ""
    return ""


def _index(path: Path, line: int, names: list[str], column: str, which: str) -> int:
    indices = [i for i, name in enumerate(names) if plain_name(name) == plain_name(column)]
    if not indices:
        raise BiogripError(
            f"{place(path, line, column)}: found no such column, allowed are {listed(names)}."
            f"{nearest(column, names)} Say which is which by {which}."
        )
    if len(indices) > 1:
        raise BiogripError(
            f"{place(path, line, column)}: found {len(indices)} columns of this name, "
            "allowed is one."
        )
    return indices[0]
