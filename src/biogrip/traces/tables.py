"""Tables in a text file: its encoding and cells, and where its tables begin and end.

A table is a row of names, perhaps more rows of a header, as of units, and rows of cells, perhaps
below a preamble. Anton Paar's programs write lines like ``Interval:``, a row of names, perhaps an
empty row, and a row of units in brackets. TRIOS writes ``[step]``, the name of the step, names, and
bare units. NumPy and AFM programs write the names in a comment above the rows, and blanks between
cells; and a table without names has numbers of columns.
"""

import csv
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from itertools import groupby, pairwise
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray
from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.traces.columns import (
    in_brackets,
    is_unit,
    listed,
    place,
    plain_name,
    shortened,
    trace_file_problem,
    unit_in_cell,
)
from biogrip.traces.measurement_block import UNREAD, MeasurementBlock

BLANKS = " "
SEPARATORS = (",", ";", "\t")
"""What parts cells, but for `BLANKS`."""

_LINE_END = re.compile(r"\r\n|\r|\n")
# Empty lines and comments; #REF!, #DIV/0! or #NAME? followed by a separator are cells.
_LEFT_OUT = re.compile(r" *(?:$|#(?!(?:[A-Z0-9/_]+[!?]|N/A|NV)\s*[,;\t]))")
_COMMENT = re.compile(r"\s*(?:[#%]+|//+)[ \t]*")
_PREFIX = re.compile(r"[^\W\d]\w*\s*[:=]\s*")
# Cells between blanks: quoted, or with a unit in brackets after a blank.
_CELL = re.compile(r'"[^"]*"|[^\s"]+(?:[ \t]+[\[(][^\])\s]*[\])])?')
_OTHERWISE = re.compile(r"[,;\t][\"\s]|[\"\s][,;\t]")
_QUOTED = re.compile(r'^\s*"(.*)"\s*$')
_WIDE_GAP = re.compile(r"\s{2,}|\t")
# Begins like a row of numbers.
_NUMBER = re.compile(r"[-+.]*\d")
_ROW = re.compile(r'[\s",;]*[-+]?[.\d][\d.,:eE+-]*[\s",;]')
# Numbers with points or commas, and of these such whose marks may be between thousands.
_MARKED = re.compile(r"[-+]?\d*[.,][\d.,]*(?:[eE][-+]?\d+)?")
_IN_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}([.,])\d{3}(?:\1\d{3})*")
# Of two numbers, minutes and seconds have a fraction: else they may as well be hours and minutes.
_CLOCK = re.compile(r"(?=\d+:\d+[:.,])(?:(\d{1,6}):(?=[0-5]\d:))?(\d{1,6}):([0-5]\d(?:[.,]\d+)?)")
_DATE = re.compile(r"(\d\d)\.(\d\d)\.(\d{4})")
DAY_S = 86_400
"""Seconds of a day."""
_GAPS = ("", "-", "na", "n/a", "#n/a", "#nv")
# Looks like a number or a time, whatever its marks mean.
_NUMERIC = re.compile(r"[-+]?\d[-+\d.,:;'\u2019\sTZeE]*|[-+]?[.,]\d[\deE+-]*")
# What a spreadsheet writes of a failed formula.
_FAILED_FORMULA = re.compile(r"#[A-Z]")
_MOST_HEADER_ROWS = 5
_PREAMBLE_LINES_SHOWN = 3
_NAMES_SHOWN = 8
_TABLES_SHOWN = 50
# Where separator and header are looked for if no line has the columns.
_LINES_SEARCHED = 200
# With these, a file of any content takes less than 1 GB. Cells are lines times the widest.
_LARGEST_BYTES, _LONGEST_LINE, _MOST_LINES, _MOST_CELLS = 50_000_000, 100_000, 1_200_000, 5_000_000


@dataclass(frozen=True)
class Sheet:
    """Cells of a text file, without empty lines and comments."""

    encoding: str
    separator: str
    """What parts cells, `BLANKS` for any number of blanks."""
    cells: NDArray[Any]
    """Cells without padding, (n_lines, n_columns), empty where a line is shorter."""
    widths: IntArray
    """Numbers of separators and one, (n_lines,)."""
    numbers: IntArray
    """Line numbers in the file, from 1, (n_lines,); 0 of names that are numbers of columns."""
    headers: list[int]
    """Places of lines that may be headers: of the first, and of those that begin with words."""
    without_end: int = 0
    """Line number of the file's last line, if it has no line end."""


@dataclass(frozen=True)
class Table:
    """A table in a sheet; its places are indices of the sheet's lines."""

    at: int
    """Place of the names."""
    names: list[str]
    first: int
    """Place of the first row; `end` is that after the last."""
    units: list[str] | None = None
    """Cells of the row of units, if there is one."""
    units_at: int | None = None
    """Its place."""
    is_step: bool = False
    """True if ``[step]`` and a name are right above the names."""
    end: int = 0
    title: str = ""
    """Some words of the preamble."""

    def indices(self, column: str) -> list[int]:
        """Return which columns have a name."""
        return [i for i, name in enumerate(self.names) if plain_name(name) == plain_name(column)]

    def common(self, columns: MeasurementBlock) -> int:
        """Count the columns to read that it has."""
        return sum(bool(self.indices(name)) for name in columns.named.values())


def read_sheet(path: Path, columns: MeasurementBlock) -> Sheet:
    """Read the cells of a text file.

    A `BiogripError` says that it is no file, or no text in UTF-8, UTF-16 or Windows-1252, or which
    quote has no end, or that file or line is too large.
    """
    encoding, lines = _read_lines(path)
    separator, numbered = _with_names(lines, {*map(plain_name, columns.named.values())})
    if not numbered:
        raise BiogripError(f"{place(path)}: found no header, allowed is a line with column names.")
    kept, numbers = [*numbered.values()], np.array([*numbered])
    headers = [at for at, text in enumerate(kept) if not (at and numbers[at] and _ROW.match(text))]
    cells, widths = _cells(path, kept, numbers, "\t" if separator == BLANKS else separator)
    without_end = len(lines) if lines[-1].strip() else 0
    return Sheet(encoding, separator, cells, widths, numbers, headers, without_end)


def overview(path: Path) -> tuple[Sheet, list[Table]]:
    """Read the cells of a text file, and find its tables, whatever columns are to be read.

    A `BiogripError` is as of `read_sheet`.
    """
    columns = replace(UNREAD, time="time_s", strain="strain")
    for _ in range(2):
        sheet = read_sheet(path, columns)
        tables = _tables(sheet, columns) or [_likely_table(sheet)]
        longest = max(tables, key=lambda table: table.end - table.first)
        # With two of its columns, every table that has them is found; without names, by numbers.
        words = [name for name in dict.fromkeys(longest.names) if name and not is_number(name)]
        first, second, *_ = [*words, "1", "2"]
        columns = replace(columns, time=first, strain=second)
    return sheet, tables


def numbers_in(sheet: Sheet, table: Table) -> dict[str, Array]:
    """Return the numbers of each column that has a name, (n_rows,): see `numbers_of`."""
    names = {name: index for index, name in reversed([*enumerate(table.names)]) if name}
    return {name: numbers_of(sheet, table, names[name]) for name in reversed(names)}


def numbers_of(sheet: Sheet, table: Table, index: int) -> Array:
    """Return the numbers of a column, (n_rows,), times of day in s; NaN or inf for others."""
    cells = [*map(str, sheet.cells[table.first : table.end, index])]
    decimal, _ = decimal_mark(cells, sheet.separator)
    number = seconds_or_inf if is_clock(cells) else number_reader(decimal)
    return np.array([*map(number, cells)], dtype=float)


def _cells(
    path: Path, lines: Sequence[str], numbers: IntArray, separator: str
) -> tuple[NDArray[Any], IntArray]:
    """Return the cells of lines, (n_lines, n_columns), and how many each line has, (n_lines,)."""
    most = [line.count(separator) + 1 for line in lines]
    if len(lines) * (widest := max(most)) > _MOST_CELLS:
        raise BiogripError(
            f"{place(path, numbers[most.index(widest)])}: found {counted(widest, 'cell')}, and "
            f"{counted(len(lines), 'line')} in all; allowed are {_MOST_CELLS} cells, if all lines "
            "were as wide."
        )
    cells, widths = np.full((len(lines), widest), "", object), np.zeros(len(lines), int)
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    row = -1
    try:
        for row, found in enumerate(reader):
            if reader.line_num > row + 1:
                raise BiogripError(
                    f"{place(path, numbers[row])}: found a quote without its end, allowed are "
                    "quoted cells that end on their line."
                )
            cells[row, : len(found)] = [*map(str.strip, found)]
            widths[row] = len(found)
    except csv.Error as error:
        raise BiogripError(f"{place(path, numbers[row + 1])}: found a {error}.") from error
    return cells, widths


def _read_lines(path: Path) -> tuple[str, list[str]]:
    encoding, text = _read_text(path)
    if (ends := max(map(text.count, "\r\n"))) > _MOST_LINES:
        said = f"found {ends} lines; allowed are at most {_MOST_LINES}."
        raise BiogripError(f"{place(path)}: {said}")
    lines = _LINE_END.split(text)
    if (longest := max(map(len, lines))) > _LONGEST_LINE:
        line = next(number for number, line in enumerate(lines, 1) if len(line) == longest)
        text = f"found {longest} characters, allowed are at most {_LONGEST_LINE} in a line."
        raise BiogripError(f"{place(path, line)}: {text}")
    return encoding, lines


def _read_text(path: Path) -> tuple[str, str]:
    """Return the encoding and the text of a file."""
    if problem := trace_file_problem(path):
        raise BiogripError(f"{place(path)}: {problem}")
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST_BYTES + 1)
    except OSError as error:
        raise BiogripError(f"{place(path)}: cannot be read: {error.strerror}.") from error
    if len(content) > _LARGEST_BYTES:
        text = f"found more than {_LARGEST_BYTES} bytes; allowed are fewer, as by fewer columns."
        raise BiogripError(f"{place(path)}: {text}")
    encodings = {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252"}
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        encodings = {"utf-16": "UTF-16"}
    for codec, encoding in encodings.items():
        try:
            return encoding, content.decode(codec)
        except UnicodeDecodeError as error:
            start = error.start
    line = len(_LINE_END.split(content[:start].decode(codec)))
    raise BiogripError(
        f"{place(path, line)}: found the byte 0x{content[start]:02x}, allowed is text in UTF-8, "
        f"UTF-16 or Windows-1252{', as a sheet saved as CSV' * content.startswith(b'PK')}."
    )


def _with_names(lines: Sequence[str], wanted: set[str]) -> tuple[str, dict[int, str]]:
    """Return the separator, and lines by number, from 1, without comments and empty ones.

    Where no other line has the wanted names, comments may have them, or they are numbers of
    columns, which then stand above the first row as line 0. Blanks between cells become tabs.
    """
    every = dict(enumerate(lines, 1))
    kept = {number: text for number, text in every.items() if not _LEFT_OUT.match(text)}
    words = [text for text in kept.values() if not _ROW.match(text)]
    separator, common = _separator([*kept.values()], words, wanted)
    first = next((number for number, text in kept.items() if _ROW.match(text + " ")), 0)
    if first and common < len(wanted):
        kept = {number: text for number, text in kept.items() if not _COMMENT.match(text)}
        if all(map(str.isdecimal, wanted)):
            names = map(str, range(1, len(_cells_of(kept[first], separator)) + 1))
            above = {number: text for number, text in kept.items() if number < first}
            kept = above | {0: separator.join(names)} | kept
        else:
            comments = [_said(text, bare=True) for text in lines if _COMMENT.match(text)]
            separator, _ = _separator([*kept.values()], [*words, *comments], wanted)
            kept = _with_comments(every, first, separator, wanted)
    if separator == BLANKS:
        width = _width(kept, separator)
        kept = {n: "\t".join(_cells_of(text, separator, width)) for n, text in kept.items()}
    return separator, kept


def _with_comments(
    every: Mapping[int, str], first: int, separator: str, wanted: set[str]
) -> dict[int, str]:
    """Return lines that are no comments, and comments of a header, which may follow ``key: value``.

    These have the wanted names, or stand beside such or above the first row, with as many words.
    """
    kept, width = dict[int, str](), _width(every, separator)
    for in_comments, group in groupby(
        every.items(), lambda line: not line[1].strip() or _COMMENT.match(line[1]) is not None
    ):
        block, header = dict(group), dict[int, str]()
        if not in_comments:
            kept |= block
            continue
        is_named = min(block) < first
        for number, text in block.items():
            cells = _cells_of(bare := _said(text, bare=True), separator, width)
            has_names = wanted <= _names(cells)
            is_named |= has_names
            if has_names or (len(cells) == width > 1 and not any(map(_NUMERIC.fullmatch, cells))):
                header[number] = bare
        if header and is_named:
            above = (
                (number, _said(text)) for number, text in block.items() if number < min(header)
            )
            kept |= {number: text for number, text in above if ":" in text} | header
    return kept


def _said(line: str, *, bare: bool = False) -> str:
    """Return what a comment says, if asked without a word before it, as ``columns:``."""
    text = _COMMENT.sub("", line, count=1).strip()
    return _PREFIX.sub("", text) if bare else text


def _width(lines: Mapping[int, str], separator: str) -> int:
    """Return the number of cells in the last row of numbers."""
    rows = (text for text in reversed([*lines.values()]) if _ROW.match(text + " "))
    return len(_cells_of(next(rows, ""), separator))


def _cells_of(line: str, separator: str, width: int = 0) -> list[str]:
    """Return the cells of a line; words with single blanks are one if there are then as many.

    Tabs part cells, which may be empty, where no blanks do.
    """
    if separator != BLANKS:
        return line.split(separator)
    tabbed = line.split("\t")
    if tabbed[1:] and (len(tabbed) == width or all(len(_CELL.findall(it)) < 2 for it in tabbed)):
        return tabbed
    if _OTHERWISE.search(line):
        return [line]
    wide = _WIDE_GAP.split(line.strip())
    return wide if len(wide) == width else _CELL.findall(line)


def _names(cells: Sequence[str]) -> set[str]:
    return {plain_name(_QUOTED.sub(r"\1", cell)) for cell in cells}


def _separator(lines: Sequence[str], headers: Sequence[str], wanted: set[str]) -> tuple[str, int]:
    """Return what parts most wanted names in a header, or the cells of most rows; and how many.

    Where no line is a row of numbers, all lines count: else words of a preamble would.
    """
    searched = [row for row in lines[:_LINES_SEARCHED] if _ROW.match(row + " ")] or lines

    def merit(separator: str) -> tuple[int, int]:
        common = 0
        for row in headers:
            wide = _WIDE_GAP.split(row.strip()) if separator == BLANKS else []
            of = (len(wanted & _names(cells)) for cells in (_cells_of(row, separator), wide))
            common = max(common, *of)
        parted = (len(_cells_of(line, separator)) > 1 for line in searched)
        return common, sum(parted)

    # Where as many lines have commas as tabs or semicolons, these are decimal commas.
    merits = {separator: merit(separator) for separator in (*SEPARATORS[::-1], BLANKS)}
    separator = max(merits, key=lambda it: merits[it])
    return separator, merits[separator][0]


def find_tables(
    path: Path, sheet: Sheet, columns: MeasurementBlock
) -> tuple[list[Table], list[int]]:
    """Find the tables of a file, and the indices of the blocks to read, or of the only one.

    A `BiogripError` lists the tables, if there is no such block, or several have the columns and
    none is asked for.
    """
    tables = _tables(sheet, columns) or [_likely_table(sheet)]
    common = [table.common(columns) for table in tables]
    count = common.count(len(columns.named))
    missing = [block for block in columns.blocks if block > len(tables)]
    if not columns.blocks and count <= 1:
        return tables, [common.index(max(common))]
    if columns.blocks and not missing:
        return tables, [block - 1 for block in columns.blocks]
    said, allowed = f"no block {missing[0] if missing else 0}", f"are 1 to {len(tables)}:"
    if not columns.blocks:
        names = ", ".join(f"'{name}'" for name in columns.named.values())
        said = f"{counted(count, 'block')} with the columns {names}"
        allowed = "is one, as by --block 1, or several that are one test, as by --block 1,2."
    shown = [
        f"\n  {number}: {_in_words(sheet, table, columns)}"
        for number, table in enumerate(tables[:_TABLES_SHOWN], 1)
    ]
    more = [f"\n  and {len(tables)} in all"] if len(tables) > _TABLES_SHOWN else []
    raise BiogripError(f"{place(path)}: found {said}, allowed {allowed}{''.join(shown + more)}")


def _in_words(sheet: Sheet, table: Table, columns: MeasurementBlock) -> str:
    """Return where a table is, some of its names, and the range of its times."""
    title = f", {table.title}" if table.title else ""
    names = [name for name in table.names if name and not name.endswith(":")]
    rows = counted(table.end - table.first, "row")
    said = f"line {sheet.numbers[table.at]}{title}; {listed(names, _NAMES_SHOWN)}; {rows}"
    for time in table.indices(columns.axis_column)[:1]:
        if table.end > table.first:
            first, last = map(shortened, sheet.cells[[table.first, table.end - 1], time])
            unit = table.units[time].strip("[]() ") if table.units else ""
            said += f", {first} to {last} {unit}".rstrip()
    return said


def _tables(sheet: Sheet, columns: MeasurementBlock) -> list[Table]:
    tables: list[Table] = []
    for at in sheet.headers:
        # Rows of a header are no names of another table.
        if not tables or at >= tables[-1].first:
            tables += filter(None, [_header(sheet, at, columns)])
    ends = [0, *(_end(sheet, *pair) for pair in pairwise(tables)), _last_end(sheet)]
    return [
        replace(table, end=max(end, table.first), title=_title(sheet, start, table))
        for table, (start, end) in zip(tables, pairwise(ends), strict=False)
        if end > table.first or table.common(columns) == len(columns.named)
    ]


def _last_end(sheet: Sheet) -> int:
    """Return the end of the last table, above words that stand alone on their lines."""
    end = len(sheet.cells)
    while end and sheet.widths[end - 1] == 1 and not _NUMBER.match(sheet.cells[end - 1, 0]):
        end -= 1
    return end


def _header(sheet: Sheet, at: int, columns: MeasurementBlock) -> Table | None:
    """Return a table whose names are on a line, or None if the line is no header.

    A header has the columns to read, or is above a row of units in brackets and rows of numbers,
    or follows ``[step]`` and the name of a step.
    """
    is_step = at >= 2 and str(sheet.cells[at - 2, 0]).lower() == "[step]"
    table = Table(at, sheet.cells[at, : sheet.widths[at]].tolist(), at + 1, is_step=is_step)
    if table.common(columns) == len(columns.named):
        return _with_header_rows(sheet, table, columns)
    filled = [name for name in table.names if name]
    if _count_numbers(filled) or len(filled) < 2 or all(map(in_brackets, filled)):
        return None
    most = min(at + 1 + _MOST_HEADER_ROWS, len(sheet.cells))
    below = [row for row in range(at + 1, most) if any(sheet.cells[row])]
    if len(below) < 2 or any(sheet.cells[below[0], len(table.names) :]):
        return None
    units = sheet.cells[below[0], : len(table.names)].tolist()
    numbers = [_count_numbers(sheet.cells[row]) for row in below[1:]]
    of_step = is_step and numbers[0] > _count_numbers(units)
    if of_step or (any(numbers) and all(map(in_brackets, filter(None, units)))):
        return replace(table, units=units, units_at=below[0], first=below[0] + 1)
    return None


def _with_header_rows(sheet: Sheet, table: Table, columns: MeasurementBlock) -> Table:
    """Return a table with its columns' units, and its first row below all rows of its header.

    Rows below the names that hold no number where numbers are read are of the header, and so are
    units right above them. The row that has most units has the units.
    """
    read = {key: table.indices(name)[0] for key, name in columns.named.items()}
    below = _header_rows(sheet, table, columns, read)
    units_in = {row: _count_units(sheet.cells[row], columns, read) for row in below}
    for row in range(table.at - 1, max(table.at - _MOST_HEADER_ROWS, 0) - 1, -1):
        if (count := _count_units(sheet.cells[row], columns, read)) > 1:
            units_in[row] = count
    with_units = (row for row, count in units_in.items() if count)
    units_at = max(with_units, key=lambda row: units_in[row], default=None)
    units = None if units_at is None else sheet.cells[units_at, : len(table.names)].tolist()
    first = max(below, default=table.at) + 1
    return replace(table, units=units, units_at=units_at, first=first)


def _header_rows(
    sheet: Sheet, table: Table, columns: MeasurementBlock, read: Mapping[str, int]
) -> list[int]:
    """Return places of rows below the names that are no row of numbers, at most five.

    Names that come again below other rows, or an empty line, are those of another table.
    """
    rows: list[int] = []
    only_names = True
    for row in range(table.at + 1, min(table.at + 1 + _MOST_HEADER_ROWS, len(sheet.cells))):
        cells = sheet.cells[row]
        has_names = replace(table, names=cells.tolist()).common(columns) == len(columns.named)
        again = only_names and sheet.numbers[row] == sheet.numbers[row - 1] + 1
        if (has_names and not again) or any(cells[len(table.names) :]):
            break
        if not _is_of_header(cells, columns, read):
            break
        only_names = has_names
        rows.append(row)
    return rows


def _is_of_header(cells: Sequence[str], columns: MeasurementBlock, read: Mapping[str, int]) -> bool:
    """Return True if cells hold no number where numbers are read, and are no row with gaps."""
    in_columns = [cells[index] for index in read.values()]
    if unit_in_cell(cells[read[columns.axis]], columns.units_of(columns.axis)):
        return True
    if any(_NUMERIC.fullmatch(cell) or _FAILED_FORMULA.match(cell) for cell in in_columns):
        return False
    words = any(cell.lower() not in _GAPS for cell in in_columns)
    return words or all(map(in_brackets, filter(None, cells)))


def _count_units(cells: Sequence[str], columns: MeasurementBlock, read: Mapping[str, int]) -> int:
    """Count the columns to read of which a row has a unit that they may have."""
    pairs = ((cells[index], columns.units_of(key)) for key, index in read.items())
    return sum(unit_in_cell(cell, units) is not None for cell, units in pairs if cell)


def _likely_table(sheet: Sheet) -> Table:
    """Return what may be the table of a file without the columns: names above numbers, or units."""
    numbers = [*map(_count_numbers, sheet.cells[:_LINES_SEARCHED])]
    pairs = enumerate(pairwise(numbers))
    at = next((at for at, (here, below) in pairs if below > here == 0), 0)
    at -= at > 0 and not numbers[at - 1] and sum(map(is_unit, sheet.cells[at])) > 1
    return Table(at, sheet.cells[at, : sheet.widths[at]].tolist(), at + 1, end=at + 1)


def _end(sheet: Sheet, table: Table, following: Table) -> int:
    """Return the place after the rows of a table, where the preamble of the following begins."""
    end = following.at
    while end > table.first and _in_preamble(sheet.cells[end - 1], len(table.names)):
        end -= 1
    return end


def _in_preamble(cells: Sequence[str], width: int) -> bool:
    """Return True if cells are no row, even a damaged one: few, or beginning like ``Test:``."""
    filled = [i for i, cell in enumerate(cells) if cell]
    first = cells[filled[0]] if filled else ":"
    return first.endswith(":") or (not is_number(first) and filled[-1] + 1 < width)


def _title(sheet: Sheet, start: int, table: Table) -> str:
    start = table.at - 1 if table.is_step else max(start, table.at - _PREAMBLE_LINES_SHOWN)
    words = (" ".join(filter(None, cells)) for cells in sheet.cells[start : table.at])
    return "; ".join(shortened(line) for line in words if line)


def _count_numbers(cells: Sequence[str]) -> int:
    return sum(map(is_number, cells))


def is_number(cell: str) -> bool:
    """Return True if a cell is a finite number, with a decimal point or comma."""
    return isfinite(number_or_inf(cell.replace(",", ".")))


def decimal_mark(cells: Sequence[str], separator: str) -> tuple[str, str]:
    """Tell the decimal mark of a table's numbers, which is one for all columns.

    Where it may everywhere as well be between thousands, such a cell is returned, too. Between
    commas that part cells no comma is decimal.
    """
    unclear: tuple[str, str] | None = None
    for cell in cells if separator != "," else ():
        if ("." in cell or "," in cell) and _MARKED.fullmatch(cell):
            mark = max(".,", key=cell.rfind)
            if not _IN_THOUSANDS.fullmatch(cell):
                return mark, ""
            unclear = unclear or (mark, cell)
    return unclear or (".", "")


def number_reader(decimal: str) -> Callable[[str], float]:
    """Return what reads numbers with a decimal mark, and gives what `number_or_inf` does."""
    other = ".,".replace(decimal, "")
    return lambda cell: inf if other in cell else number_or_inf(cell.replace(decimal, "."))


def seconds_or_inf(cell: str) -> float:
    """Return seconds of hours, minutes, seconds, and perhaps a date, else as `number_or_inf`."""
    if found := _CLOCK.fullmatch(cell):
        hours, minutes, seconds = found.groups()
        return 3600 * int(hours or 0) + 60 * int(minutes) + float(seconds.replace(",", "."))
    if cell.count(":") > 1:
        with suppress(ValueError):
            moment = datetime.fromisoformat(_DATE.sub(r"\3-\2-\1", cell))
            passed = moment.replace(tzinfo=None) - datetime.min
            return (passed - (moment.utcoffset() or timedelta())).total_seconds()
    return nan if cell.lower() in _GAPS else inf


def is_clock(cells: Sequence[str]) -> bool:
    """Return True if the first cell that is no gap has hours, minutes and seconds."""
    return isfinite(next((s for s in map(seconds_or_inf, cells[:_LINES_SEARCHED]) if s == s), inf))


def number_or_inf(cell: str) -> float:
    """Return a cell's number, NaN for a gap, and inf for anything else."""
    try:
        # Python reads 1_000 as a number; in a table it is damage.
        return inf if "_" in cell else float(cell)
    except ValueError:
        return nan if cell.lower() in _GAPS else inf
