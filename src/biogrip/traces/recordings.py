"""Reader of recorded traces in the user's own files, with gaps, units and line numbers."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from io import TextIOWrapper
from itertools import chain, islice
from pathlib import Path

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.traces.blocks import Block, Header, Lines, chosen, find_blocks, find_header
from biogrip.traces.cells import cells_or_none
from biogrip.traces.columns import Columns, place
from biogrip.traces.encoding import read_as_text
from biogrip.traces.header import hint_on_header, layout_of, split_header
from biogrip.traces.recognised import Recognised
from biogrip.traces.rows import MOST_ROWS, Layout, check_row_count, read_rows
from biogrip.traces.units import TIME_UNITS, unit_of

FEWEST_SAMPLES = 10

# Relative to the last time: smaller steps are damaged numbers, not a clock's.
_SHORTEST_STEP = 1e-18

# Spreadsheet errors like #REF!, #DIV/0! or #NAME? followed by a separator are cells, not comments.
_COMMENT = re.compile(r" *#(?!(?:[A-Z0-9/_]+[!?]|N/A|NV)\s*[,;\t])")
# Enough to see a header, what is below it, and whether numbers have a decimal comma.
_FIRST_LINES = 50


@dataclass(frozen=True)
class Recording:
    """A recorded trace."""

    time_s: Array
    """Strictly increasing times, (n_samples,)."""
    rotation_rad: Array
    """Closing rotation of the left arm, (n_samples,)."""
    lines: IntArray
    """Line number of each sample, from 1, (n_samples,)."""
    without_number: int
    """Number of rows left out as gaps."""
    sd_rad: Array | None = None
    """Standard deviations of the rotations, (n_samples,), where the file has them."""
    recognised: Recognised | None = None
    """What was recognised in the file."""


@dataclass(frozen=True)
class _Table:
    """Numbers of a file in its own units."""

    values: Array
    """Numbers, (n_rows, n_columns), NaN for gaps."""
    lines: IntArray
    """Line numbers, (n_rows,)."""
    sizes: Array
    """Units of the columns in SI units, (n_columns,)."""
    form: Recognised
    """What was recognised in the file."""


def read_recording(path: Path, columns: Columns) -> Recording:
    """Read a recorded trace.

    The file is text in UTF-8, in UTF-16 with a byte order mark, or else in Windows-1252, as older
    programs write it, with any usual line ends. The first ``skip`` lines are ignored, and so are
    empty lines and lines that start with ``#``. The header is the first other line; or a later
    one that has the columns, or a row of units below it, as rheometers export (see
    `biogrip.traces.blocks`). Of several such tables, ``block`` says which. The header decides the
    separator: comma, semicolon or tab. With the last two, numbers may have a decimal comma. Cells
    may be quoted and padded with blanks, but a quoted cell ends on its line. Other columns may hold
    anything.

    The unit is that of `columns`, or else the end of the column's name, as in ``rotation_urad``,
    ``phi (mrad)`` or ``time [s]``, or that of the row of units; it is never guessed. The micro sign
    may replace the u, and ``Pa^-1`` stand for ``1/Pa``.

    An empty cell, ``nan``, ``NA``, ``N/A``, ``#N/A``, ``#NV`` (in any case) or ``-`` is a gap. Its
    row is left out and counted; nothing is interpolated. Other spreadsheet errors, as ``#REF!``,
    are refused.

    Parameters
    ----------
    path
        The file.
    columns
        Columns to read.

    Returns
    -------
    Recording
        Trace in SI units.

    Raises
    ------
    BiogripError
        If the file cannot be read as text, lacks a column or repeats it, has it in several blocks
        of which none is named, its unit is unknown or contradicts the name, a row has too few or
        too many cells, or text that is neither a finite number nor a gap, a standard deviation is
        not positive, the time does not increase, or there are fewer than `FEWEST_SAMPLES` samples
        or more than `MOST_ROWS` rows.
    """
    table = read_as_text(path, partial(_read, path, columns))
    gaps = np.any(np.isnan(table.values), axis=1)
    kept, lines = table.values[~gaps], table.lines[~gaps]
    without_number = len(table.lines) - len(lines)
    _check_count(path, columns, len(kept), without_number)
    if columns.sd is not None:
        _check_positive(path, columns.sd, kept[:, 2], lines)
    averaged = 0
    if columns.average_repeated:
        kept, lines, averaged = average_repeated(kept, lines)
        _check_count(path, columns, len(kept), without_number, "time")
    _check_order(path, columns, kept[:, 0], lines)
    used = _is_used(columns, table.sizes[0] * kept[:, 0])
    kept, lines, outside = kept[used], lines[used], int(np.count_nonzero(~used))
    _check_count(path, columns, len(kept), without_number, "time to use")
    factors = np.array([1.0, columns.scale, abs(columns.scale)][: len(table.sizes)])
    time_s, rotation_rad, *sd_rad = (
        own * size for own, size in zip(kept.T, table.sizes * factors, strict=True)
    )
    form = replace(
        table.form,
        rows=len(table.lines),
        gaps=without_number,
        averaged=averaged,
        outside=outside,
        range_s=(float(time_s[0]), float(time_s[-1])),
    )
    known_sd = sd_rad[0] if sd_rad else None
    return Recording(time_s, rotation_rad, lines, without_number, known_sd, form)


def _is_used(columns: Columns, time_s: Array) -> BoolArray:
    """Return True for times, (n_rows,), that are to be used."""
    first = -np.inf if columns.from_s is None else columns.from_s
    last = np.inf if columns.until_s is None else columns.until_s
    return (time_s >= first) & (time_s <= last)


def average_repeated(values: Array, lines: IntArray) -> tuple[Array, IntArray, int]:
    """Average successive rows of equal times, as a rounded clock writes them.

    Parameters
    ----------
    values : (n_rows, n_columns)
        Times, readings and, if there is a third column, standard deviations; of a mean that is the
        root of their sum of squares over their number.
    lines : (n_rows,)
        Line numbers.

    Returns
    -------
    values : (n_times, n_columns)
        Means.
    lines : (n_times,)
        Line of the first row of each time.
    int
        Number of rows that are averaged with others.
    """
    starts = np.flatnonzero(np.append(True, np.diff(values[:, 0]) != 0))
    counts = np.diff(np.append(starts, len(values)))
    shares = values / np.repeat(counts, counts)[:, None]
    means = np.add.reduceat(shares, starts, axis=0)
    means[:, 0] = values[starts, 0]
    if values.shape[1] > 2:
        means[:, 2] = np.hypot.reduceat(shares[:, 2], starts)
    return means, lines[starts], int(np.sum(counts[counts > 1]))


def _read(path: Path, columns: Columns, stream: TextIOWrapper, encoding: str) -> _Table:
    """Read the columns of a table, or of the block that is asked for."""
    numbered = _significant(path, stream, columns.skip)
    first = [*islice(numbered, _FIRST_LINES)]
    if not first:
        raise BiogripError(f"{place(path)}: found no header, allowed is a line with column names.")
    header = find_header(path, first, 0, columns)
    if columns.block is None and header is not None and not header.units:
        return _read_plain(path, columns, stream, encoding, header, first, numbered)
    lines = [*first, *islice(numbered, MOST_ROWS)]
    blocks = find_blocks(path, lines, columns)
    if not blocks:
        _refuse_header(path, lines, columns)
    number = chosen(path, lines, blocks, columns)
    return _read_block(path, columns, encoding, lines, blocks, number)


def _refuse_header(path: Path, lines: Lines, columns: Columns) -> None:
    """Refuse the first line as a header, and say which other line may be the header."""
    separator, names = split_header(path, *lines[0], [*columns.named.values()])
    try:
        layout_of(path, lines[0][0], separator, names, columns)
    except BiogripError as error:
        raise BiogripError(f"{error}{hint_on_header(path, lines, columns)}") from error


def _read_plain(
    path: Path,
    columns: Columns,
    stream: TextIOWrapper,
    encoding: str,
    header: Header,
    first: Lines,
    numbered: Iterator[tuple[int, str]],
) -> _Table:
    """Read a table that is the whole file, whose header has no units below it."""
    at = first[0][0]
    layout = layout_of(path, at, header.separator, header.names, columns)
    sizes, form = _recognise(path, columns, layout, Block(header, "", first[1:]), encoding, at)
    from biogrip.traces.plain_rows import plain_rows  # Arrow takes as long as a short job.

    plain = plain_rows(path, at, layout.width, [*layout.indices.values()], layout.separator)
    if plain is not None and len(plain) <= MOST_ROWS:
        return _Table(plain, at + 1 + np.arange(len(plain)), sizes, form)
    try:
        return _Table(*read_rows(path, chain(first[1:], numbered), layout), sizes, form)
    except BiogripError:
        # The header may stand again below.
        stream.seek(0)
        lines = [*islice(_significant(path, stream, columns.skip), MOST_ROWS)]
        chosen(path, lines, find_blocks(path, lines, columns), columns)
        raise


def _read_block(
    path: Path, columns: Columns, encoding: str, lines: Lines, blocks: list[Block], number: int
) -> _Table:
    """Read one of the blocks of a file."""
    block = blocks[number]
    check_row_count(path, len(block.lines))
    at = lines[block.header.index][0]
    layout = layout_of(path, at, block.header.separator, block.header.names, columns)
    sizes, form = _recognise(path, columns, layout, block, encoding, at)
    units_line = lines[block.header.first - 1][0] if block.header.units else None
    of = (number + 1, len(blocks)) if len(blocks) > 1 else (None, 1)
    form = replace(form, units_line=units_line, block=of[0], blocks=of[1], title=block.title)
    return _Table(*read_rows(path, block.lines, layout), sizes, form)


def _recognise(
    path: Path, columns: Columns, layout: Layout, block: Block, encoding: str, at: int
) -> tuple[Array, Recognised]:
    """Return the sizes of the columns' units, and what was recognised of their header."""
    below = {
        name: block.header.units[i] if i < len(block.header.units) else ""
        for name, i in layout.indices.items()
    }

    def unit(column: str, given: str | None, key: str) -> str:
        allowed = TIME_UNITS if key == "time_unit" else columns.quantity.units
        by_options, cell = columns.by_options, below[column]
        return unit_of(path, column, given, allowed, key, by_options=by_options, below=cell)

    units = [
        unit(columns.time, columns.time_unit, "time_unit"),
        unit(columns.reading, columns.reading_unit, columns.unit_key),
    ]
    if columns.sd is not None:
        units.append(unit(columns.sd, units[1], columns.unit_key))
    sizes = [TIME_UNITS[units[0]], *(columns.quantity.units[each] for each in units[1:])]
    by_quantity = dict(zip(columns.named, zip(layout.indices, units, strict=True), strict=True))
    comma = _has_decimal_comma(block.lines[:_FIRST_LINES], layout)
    form = Recognised(encoding, layout.separator, comma, at, None, None, 1, "", by_quantity)
    return np.array(sizes), form


def _has_decimal_comma(lines: Lines, layout: Layout) -> bool:
    """Return True if numbers in columns to read have a decimal comma."""
    if layout.separator == ",":
        return False
    rows = (cells_or_none(line, layout.separator) for _, line in lines if "," in line)
    at = {*layout.indices.values()}
    return any("," in cell for row in rows for i, cell in enumerate(row) if i in at)


def _significant(path: Path, stream: TextIOWrapper, skip: int) -> Iterator[tuple[int, str]]:
    """Yield numbers of lines that are neither empty nor comments, and the lines."""
    for number, line in islice(enumerate(stream, 1), skip, None):
        if "\0" in line:
            raise BiogripError(f"{place(path, number)}: found binary data, allowed is text.")
        if line.strip(" \r\n") and not _COMMENT.match(line):
            yield number, line


def _all(columns: Columns) -> str:
    *names, last = columns.named.values()
    return f"{'both ' if len(names) == 1 else ''}{', '.join(names)} and {last}"


def _check_count(
    path: Path, columns: Columns, found: int, without_number: int, what: str = "row"
) -> None:
    if found < FEWEST_SAMPLES:
        gaps = f" ({counted(without_number, 'row')} with NaN)" if without_number else ""
        raise BiogripError(
            f"{place(path)}: found {counted(found, what)} with a number in {_all(columns)}{gaps}, "
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
        found = f"{now:.15g} repeated" if now == before else f"{now:.15g} after {before:.15g}"
        by = f", by more than {least:.1g}" if now > before else ""
        hint = ""
        if now == before:
            value = "" if columns.by_options else ": true"
            key = columns.said_by("average_repeated").replace("repeated", f"repeated{value}")
            hint = f" The readings of equal times are averaged by {key}."
        raise BiogripError(
            f"{place(path, lines[row + 1], columns.time)}: found {found} "
            f"(line {lines[row]}), allowed are times that increase{by}.{hint}"
        )
