"""Blocks of a file: tables below preambles, with rows of units, as rheometers export them.

Anton Paar's programs write lines like ``Interval:``, a row of names, perhaps an empty row, and a
row of units in brackets. TRIOS writes ``[step]``, the name of the step, names, and bare units.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.traces.cells import cells_or_none, count_numbers, is_number, number_or_inf
from biogrip.traces.columns import Columns, listed, place, shortened
from biogrip.traces.header import has_columns, split_header
from biogrip.traces.units import TIME_UNITS, bare_unit, in_brackets, plain_name, unit_in_cell

_STEP = re.compile(r'[\s"]*\[step\][\s",;]*', re.IGNORECASE)
# Begins like a row of numbers.
_ROW = re.compile(r'[\s",;]*[-+]?[.\d][\d.,eE+-]*[\s",;]')
_PREAMBLE_LINES_SHOWN = 3
_NAMES_SHOWN = 8
_SHOWN_AT_MOST = 50

Lines = Sequence[tuple[int, str]]
"""Line numbers and lines that are neither empty nor comments."""


@dataclass(frozen=True)
class Header:
    """A row of names, with its row of units if there is one."""

    index: int
    """Index of the row of names."""
    separator: str
    """Cell separator."""
    names: list[str]
    """Names of the columns."""
    units: list[str]
    """Cells of the row of units; empty without one."""
    first: int
    """Index of the first row of numbers."""
    begins: int
    """Index of what certainly is its preamble already."""


@dataclass(frozen=True)
class Block:
    """A table of a file, with its preamble."""

    header: Header
    """Its names and units."""
    title: str
    """Some words of its preamble."""
    lines: Lines
    """Its rows."""

    def in_words(self, number: int, header_line: int, columns: Columns) -> str:
        """Return a line for a list of blocks."""
        rows = counted(len(self.lines), "row")
        named = [name for name in self.header.names if name and not name.endswith(":")]
        names = listed(named, _NAMES_SHOWN)
        begins = f"  {number}: line {header_line}{f', {self.title}' if self.title else ''}"
        return f"{begins}; {names}; {rows}{self._time_range(columns)}"

    def _time_range(self, columns: Columns) -> str:
        names = [*map(plain_name, self.header.names)]
        if not self.lines or plain_name(columns.time) not in names:
            return ""
        at = names.index(plain_name(columns.time))
        rows = [cells_or_none(self.lines[i][1], self.header.separator) for i in (0, -1)]
        unit = bare_unit(self.header.units[at]) if at < len(self.header.units) else ""
        ends = " to ".join(shortened(row[at]) for row in rows if at < len(row))
        return f", {ends} {unit}".rstrip()


def find_header(path: Path, lines: Lines, index: int, columns: Columns) -> Header | None:
    """Return the header at an index of lines, or None if that is no header.

    A header has the columns to read, or is above a row of units in brackets and rows of numbers,
    or follows ``[step]`` and the name of a step.
    """
    in_step = index >= 2 and _STEP.fullmatch(lines[index - 2][1]) is not None
    if not in_step and index > 0 and _ROW.match(lines[index][1]):
        return None
    try:
        separator, names = split_header(path, *lines[index], [*columns.named.values()])
    except BiogripError:
        return None
    named = has_columns(names, columns)
    if not named and (count_numbers(names) or sum(map(bool, names)) < 2):
        return None
    below = index + 1
    while below < len(lines) and not any(cells_or_none(lines[below][1], separator)):
        below += 1
    begins = index - 2 if in_step else index
    rows = [cells_or_none(line, separator) for _, line in lines[below : below + 2]]
    cells, after = [*rows, [], []][:2]
    if _are_units(cells, after, names, columns, named=named, in_step=in_step):
        return Header(index, separator, names, cells, below + 1, begins)
    return Header(index, separator, names, [], index + 1, begins) if named else None


def find_blocks(path: Path, lines: Lines, columns: Columns) -> list[Block]:
    """Return all blocks in the order of the file."""
    found = (find_header(path, lines, index, columns) for index in range(len(lines)))
    headers = [header for header in found if header is not None]
    begins = [0, *(_end(lines, one, other) for one, other in pairwise(headers)), len(lines)]
    return [
        Block(header, _title(lines, start, header), lines[header.first : end])
        for header, (start, end) in zip(headers, pairwise(begins), strict=False)
    ]


def chosen(path: Path, lines: Lines, blocks: list[Block], columns: Columns) -> int:
    """Return the index of the block to read.

    Raises
    ------
    BiogripError
        With a list of the blocks, if there is no such block, or no block is asked for and several
        have the columns.
    """
    if columns.block is not None:
        if columns.block <= len(blocks):
            return columns.block - 1
        raise BiogripError(
            f"{place(path)}: found no block {columns.block}, allowed are 1 to {len(blocks)}:"
            f"{_in_words(lines, blocks, columns)}"
        )
    named = [i for i, block in enumerate(blocks) if has_columns(block.header.names, columns)]
    if len(named) > 1:
        which = ", ".join(f"'{name}'" for name in columns.named.values())
        raise BiogripError(
            f"{place(path)}: found {counted(len(named), 'block')} with the columns {which}, "
            f"allowed is one: say which by {columns.said_by('block')}."
            f"{_in_words(lines, blocks, columns)}"
        )
    needed = {*map(plain_name, columns.named.values())}
    common = [len(needed & {*map(plain_name, block.header.names)}) for block in blocks]
    return common.index(max(common))


def _in_words(lines: Lines, blocks: list[Block], columns: Columns) -> str:
    words = [
        block.in_words(number, lines[block.header.index][0], columns)
        for number, block in enumerate(blocks[:_SHOWN_AT_MOST], 1)
    ]
    more = [f"  and {len(blocks)} in all"] if len(blocks) > _SHOWN_AT_MOST else []
    return "".join(f"\n{line}" for line in [*words, *more])


def _are_units(
    cells: list[str],
    below: list[str],
    names: list[str],
    columns: Columns,
    *,
    named: bool,
    in_step: bool,
) -> bool:
    """Return True if the cells below names are units."""
    if not any(cells) or len(cells) > len(names):
        return False
    if in_step:
        return not count_numbers(cells) or count_numbers(below) > count_numbers(cells)
    at = [i for i, cell in enumerate(cells) if cell]
    if all(in_brackets(cells[i]) for i in at):
        numbers = [below[i] for i in at if i < len(below)]
        return named or (
            all(is_number(cell) or number_or_inf(cell) != float("inf") for cell in numbers)
            and count_numbers(numbers) > 0
        )
    times = [i for i, name in enumerate(names) if plain_name(name) == plain_name(columns.time)]
    return named and any(i < len(cells) and unit_in_cell(cells[i], TIME_UNITS) for i in times)


def _end(lines: Lines, header: Header, following: Header) -> int:
    """Return the index after the rows of a header, where the preamble of the following begins."""
    end = following.begins
    if end < following.index:
        return max(end, header.first)
    while end > header.first and _in_preamble(lines[end - 1][1], header):
        end -= 1
    return end


def _in_preamble(line: str, header: Header) -> bool:
    """Return True if a line is no row, even a damaged one: it is short, or begins ``Test:``."""
    cells = cells_or_none(line, header.separator)
    filled = [i for i, cell in enumerate(cells) if cell]
    if not filled:
        return True
    first = cells[filled[0]]
    return first.endswith(":") or (not is_number(first) and filled[-1] + 1 < len(header.names))


def _title(lines: Lines, start: int, header: Header) -> str:
    """Return words of a preamble: the name of a step, or the last few lines."""
    if header.begins < header.index:
        start = header.begins + 1
    shown = lines[max(start, header.index - _PREAMBLE_LINES_SHOWN) : header.index]
    return "; ".join(shortened(words) for words in _worded(shown) if words)


def _worded(lines: Lines) -> Iterator[str]:
    for _, line in lines:
        yield " ".join(re.sub(r'[\t;,"]+', " ", line).split())
