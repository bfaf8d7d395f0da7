"""Reader of recorded traces in the user's own files, with gaps, units and line numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest
from biogrip.terminal import visible
from biogrip.traces.columns import (
    TIME_UNITS,
    Columns,
    listed,
    place,
    shortened,
    unit_of,
)
from biogrip.traces.tables import BLANKS, Sheet, Table, find_tables, number_or_inf, read_sheet

FEWEST_SAMPLES = 10

# Relative to the last time: smaller steps are damaged numbers, not a clock's.
_SHORTEST_STEP = 1e-18
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", BLANKS: "blanks"}


def is_usual(form: Mapping[str, Any], columns: Columns) -> bool:
    """Return True if a file, by its `Recording.form`, is a table as biogrip itself would write."""
    odd = ("units_line", "block", "preamble", "averaged", "outside", "others")
    return (
        (form["encoding"], form["separator"], form["decimal"]) == ("UTF-8", "commas", "point")
        and not any(key in form for key in odd)
        and columns.block is None
        and columns.load is None
        and (columns.time, columns.reading) == ("time_s", columns.quantity.column)
    )


def form_in_words(path: Path, form: Mapping[str, Any]) -> str:
    """Return a `Recording.form` as a small table."""
    columns = form["columns"].items()
    named = {key: f"{each['column']}, in {each['unit']}" for key, each in columns}
    found = {key: value for key, value in form.items() if key != "columns"} | named
    rows = (f"\n  {key:<13}{visible(value)}" for key, value in found.items())
    return f"{visible(path)} is read as{''.join(rows)}"


@dataclass(frozen=True)
class Recording:
    """A recorded trace."""

    time_s: Array
    """Strictly increasing times, (n_samples,)."""
    readings: Array
    """Closing rotation of the left arm, or another reading in SI units, (n_samples,)."""
    lines: IntArray
    """Line number of each sample, from 1, (n_samples,)."""
    without_number: int
    """Number of rows left out as gaps."""
    path: Path
    """The file."""
    read: Columns
    """What was read of it."""
    units: tuple[str, str]
    """Units of the times and of the readings in the file."""
    sd: Array | None = None
    """Standard deviations of the rotations, (n_samples,), where the file has them."""
    form: Mapping[str, Any] = field(default_factory=dict)
    """What was recognised in the file, for people to check before they believe a fit; `read_as` of
    the JSON file."""
    load: Array | None = None
    """Times and loads, or deformations, in SI units, (n, 2), where they are read: of all rows, used
    or not."""


def read_recording(path: Path, columns: Columns) -> Recording:
    """Read the columns of a recorded trace from a file.

    The file is text in UTF-8, UTF-16 or Windows-1252. Empty lines and lines that start with ``#``
    are ignored. The header is the line that has the columns, or has a row of units below it; of
    several such tables, ``block`` says which. The header decides the separator: comma, semicolon or
    tab. With the last two, numbers may have a decimal comma. Cells may be quoted and padded with
    blanks, but a quoted cell ends on its line. Other columns may hold anything.

    An empty cell, ``nan``, ``NA``, ``N/A``, ``#N/A``, ``#NV`` (in any case) or ``-`` is a gap. Its
    row is left out and counted; nothing is interpolated. Other spreadsheet errors, as ``#REF!``,
    are refused.

    Raises
    ------
    BiogripError
        If the file is no text, lacks a column or repeats it, has it in several blocks of which none
        is named, a unit is unknown or contradicted, a row has too few or too many cells, or text
        that is neither a finite number nor a gap, a standard deviation is not positive, the time
        does not increase, or there are fewer than `FEWEST_SAMPLES` samples.
    """
    sheet = read_sheet(path, columns)
    tables, index = find_tables(path, sheet, columns)
    table = tables[index]
    header_line = int(sheet.numbers[table.at]) or None
    indices, units = _columns_of(path, header_line, table, columns)
    values, decimal = _numbers(path, sheet, table, indices)
    lines, load = sheet.numbers[table.first : table.end], None
    if columns.load is not None:
        history, values = values[:, [0, -1]], values[:, :-1]
        numbers = ~np.any(np.isnan(history), axis=1)
        load = _load(path, columns, history[numbers], lines[numbers], units)
    chosen = _chosen(path, sheet, table, columns)
    gaps = chosen & np.any(np.isnan(values), axis=1)
    kept, lines = values[chosen & ~gaps], lines[chosen & ~gaps]
    without_number = int(np.count_nonzero(gaps))
    _check_count(path, columns, len(kept), without_number)
    if columns.sd is not None:
        _check_positive(path, columns.sd, kept[:, 2], lines)
    averaged = 0
    if columns.average_repeated:
        kept, lines, averaged = _averaged(kept, lines)
    _check_order(path, columns, kept[:, 0], lines)
    time_s = kept[:, 0] * TIME_UNITS[units[0]]
    used = np.ones(len(time_s), bool)
    if columns.from_s is not None:
        used &= time_s >= columns.from_s
    if columns.until_s is not None:
        used &= time_s <= columns.until_s
    kept, lines, time_s = kept[used], lines[used], time_s[used]
    _check_count(path, columns, len(kept), without_number, "usable time")
    names_and_units = (
        {"column": table.names[i], "unit": unit} for i, unit in zip(indices, units, strict=True)
    )
    several = len(tables) > 1
    form = {
        "encoding": sheet.encoding,
        "separator": _SEPARATORS[sheet.separator],
        "decimal": decimal,
        "header_line": header_line,
        "units_line": None if table.units is None else int(sheet.numbers[table.first - 1]),
        "block": index + 1 if several else None,
        "blocks": len(tables) if several else None,
        "preamble": table.title or None,
        "columns": dict(zip(columns.named, names_and_units, strict=True)),
        "rows": len(values),
        "gaps": without_number,
        "averaged": averaged or None,
        "outside": int(np.count_nonzero(~used)) or None,
        "others": int(np.count_nonzero(~chosen)) or None,
        "first_s": float(time_s[0]),
        "last_s": float(time_s[-1]),
    }
    unit = columns.quantity.units[units[1]]
    return Recording(
        time_s,
        kept[:, 1] * (unit * columns.scale),
        lines,
        without_number,
        path,
        columns,
        (units[0], units[1]),
        sd=None if columns.sd is None else kept[:, 2] * (unit * abs(columns.scale)),
        form={key: value for key, value in form.items() if value is not None},
        load=load,
    )


def _columns_of(
    path: Path, line: int | None, table: Table, columns: Columns
) -> tuple[list[int], list[str]]:
    """Return where the columns to read are in a table, and their units; or list what is wrong."""
    found: dict[int, str] = {}
    units: list[str] = []
    problems: list[str] = []
    ways = columns.said_by(*columns.named)
    if not any(table.indices(it) for it in columns.named.values()) and all(
        isfinite(number_or_inf(name.replace(",", "."))) for name in table.names if name
    ):
        raise BiogripError(
            f"{place(path, line)}: found numbers, allowed is a line with the names of the columns; "
            f"or say their numbers, 1 to {len(table.names)}, by {ways}, and their units."
        )
    for key, column in columns.named.items():
        same, where = table.indices(column), place(path, line, column)
        if not same:
            problems.append(
                f"{where}: found no such column, allowed are {listed(table.names)}."
                f"{nearest(column, table.names)} Say which is which by {ways}."
            )
            continue
        if len(same) > 1:
            problems += [f"{where}: found {len(same)} columns of this name, allowed is one."]
        elif same[0] in found:
            text = f"found {found[same[0]]} and {key} in one column, allowed are two."
            problems += [f"{where}: {text}"]
        found[same[0]] = key
        below = table.units[same[0]] if table.units else ""
        try:
            units.append(_unit(path, key, below, columns, units))
        except BiogripError as error:
            problems.append(str(error))
    if problems:
        raise BiogripError("\n".join(problems))
    return list(found), units


def _unit(path: Path, key: str, below: str, columns: Columns, units: list[str]) -> str:
    """Return the unit of a column; standard deviations have that of the readings before them."""
    name, given, unit_key = columns.named[key], columns.reading_unit, columns.unit_key
    allowed = columns.quantity.units
    if key == "time":
        given, unit_key, allowed = columns.time_unit, "time_unit", TIME_UNITS
    elif key == "load":
        given, unit_key, allowed = columns.load_unit, "load_unit", columns.controlled.units
    elif key == "sd":
        given = units[1] if len(units) > 1 else given
    return unit_of(path, name, given, allowed, columns.said_by(unit_key), below)


def _numbers(path: Path, sheet: Sheet, table: Table, indices: list[int]) -> tuple[Array, str]:
    """Return the numbers of columns, (n_rows, n_columns), NaN for gaps, and the decimal sign."""
    rows, width = slice(table.first, table.end), len(table.names)
    cells, lines = sheet.cells[rows], sheet.numbers[rows]
    for index in indices:
        for row in np.flatnonzero(sheet.widths[rows] <= index)[:1]:
            raise BiogripError(
                f"{place(path, lines[row], table.names[index])}: found only "
                f"{counted(sheet.widths[rows][row], 'cell')} in the row, allowed are the header's "
                f"{width}."
            )
    # Empty cells at the end are common.
    for row in np.flatnonzero(np.any(cells[:, width:] != "", axis=1))[:1]:
        raise BiogripError(
            f"{place(path, lines[row])}: found {counted(sheet.widths[rows][row], 'cell')} in the "
            f"row, allowed are the header's {width}. A decimal comma needs semicolons or tabs as "
            "separators."
        )
    decimal, values = "point", np.empty((len(cells), len(indices)))
    for column, index in enumerate(indices):
        texts = cells[:, index].tolist()
        if sheet.separator != "," and any("," in text for text in texts):
            decimal, texts = "comma", [text.replace(",", ".") for text in texts]
        values[:, column] = np.fromiter(map(number_or_inf, texts), float, len(cells))
        for row in np.flatnonzero(np.isinf(values[:, column]))[:1]:
            raise BiogripError(
                f"{place(path, lines[row], table.names[index])}: found "
                f"'{shortened(cells[row, index])}', allowed is a finite number, or nan, NA, N/A, - "
                "or nothing where there is none."
            )
    return values, decimal


def _chosen(path: Path, sheet: Sheet, table: Table, columns: Columns) -> BoolArray:
    """Return which rows have the values of other columns that are asked for, (n_rows,)."""
    chosen = np.ones(table.end - table.first, bool)
    for column, wanted in (columns.rows or {}).items():
        where = place(path, int(sheet.numbers[table.at]) or None, column)
        if not (same := table.indices(column)):
            text = f"found no such column, allowed are {listed(table.names)}."
            raise BiogripError(f"{where}: {text}{nearest(column, table.names)}")
        cells = [str(cell) for cell in sheet.cells[table.first : table.end, same[0]]]
        values = [*dict.fromkeys(cells)]
        fits = {it for it in values if it == str(wanted) or number_or_inf(it) == wanted}
        if not fits:
            text = f"found no row with '{wanted}', allowed are {listed(values, 10)}."
            raise BiogripError(f"{where}: {text}{nearest(wanted, values)}")
        chosen &= [cell in fits for cell in cells]
    return chosen


def _load(path: Path, columns: Columns, history: Array, lines: IntArray, units: list[str]) -> Array:
    """Return rows of times and loads, (n, 2), in SI units."""
    _check_count(path, columns, len(history), 0)
    if columns.average_repeated:
        history, lines, _ = _averaged(history, lines)
    _check_order(path, columns, history[:, 0], lines)
    sizes: Array = history * [TIME_UNITS[units[0]], columns.controlled.units[units[-1]]]
    return sizes


def _averaged(values: Array, lines: IntArray) -> tuple[Array, IntArray, int]:
    """Average rows of equal times; return the means, their first lines, and how many rows it were.

    The standard deviation of a mean is the root of the sum of squares over the number.
    """
    starts = np.flatnonzero(np.append(True, np.diff(values[:, 0]) != 0))
    counts = np.diff(np.append(starts, len(values)))
    means = np.add.reduceat(values, starts) / counts[:, None]
    means[:, 0] = values[starts, 0]
    means[:, 2:] = np.hypot.reduceat(values[:, 2:], starts) / counts[:, None]
    return means, lines[starts], int(np.sum(counts[counts > 1]))


def _check_count(
    path: Path, columns: Columns, found: int, without_number: int, what: str = "row"
) -> None:
    if found < FEWEST_SAMPLES:
        gaps = f" ({counted(without_number, 'row')} with NaN)" if without_number else ""
        *names, last = columns.named.values()
        which = f"{'both ' if len(names) == 1 else ''}{', '.join(names)} and {last}"
        raise BiogripError(
            f"{place(path)}: found {counted(found, what)} with a number in {which}{gaps}, "
            f"allowed are at least {FEWEST_SAMPLES}."
        )


def _check_positive(path: Path, column: str, sd: Array, lines: IntArray) -> None:
    for row in np.flatnonzero(sd <= 0)[:1]:
        raise BiogripError(
            f"{place(path, lines[row], column)}: found {sd[row]:.15g}, allowed is a standard "
            "deviation above 0."
        )


def _check_order(path: Path, columns: Columns, time: Array, lines: IntArray) -> None:
    least = _SHORTEST_STEP * float(np.max(np.abs(time)))
    for row in np.flatnonzero(np.diff(time) <= least)[:1]:
        before, now = time[row : row + 2]
        found, hint = f"{now:.15g} after {before:.15g}", ""
        if now == before:
            found = f"{now:.15g} repeated"
            way = columns.said_by("average_repeated")
            hint = f" The readings of equal times are averaged by {way}."
        by = f", by more than {least:.1g}" if now > before else ""
        raise BiogripError(
            f"{place(path, lines[row + 1], columns.time)}: found {found} "
            f"(line {lines[row]}), allowed are times that increase{by}.{hint}"
        )
