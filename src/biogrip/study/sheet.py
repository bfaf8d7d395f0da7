"""Reader of sheets: tables with a row for each recorded trace, its cell, factors and settings."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError, nearest
from biogrip.study.named_blocks import NamedBlocks
from biogrip.study.sheet_columns import Setting, leaves, nested, setting_of, shown
from biogrip.study.sheet_text import CELL, FILE, Line, Table, read_table
from biogrip.study.source import KeyPath, overlaid
from biogrip.study.trace_file import trace_file_problem
from biogrip.study.yaml_text import shown_path
from biogrip.traces.columns import place

GROUP = "group"
"""The factor that makes groups by default."""

MOST_SHOWN = 10
"""Number of problems in a message."""


@dataclass(frozen=True)
class Row:
    """A recorded trace, as its row in a sheet describes it."""

    sheet: Path
    """File of the sheet."""
    line: int
    """Line of the row there, from 1."""
    file: Path
    """File of the trace."""
    cell: str
    """Name of its cell; rows of one cell are replicates."""
    factors: Mapping[str, str] = field(default_factory=dict)
    """Values of the factors by name, "" where there is none."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Blocks of a config with what the row says of its case, to be laid over a config."""

    def lines(self, case: str) -> tuple[str, dict[KeyPath, int]]:
        """Return the sheet's path, and the row's line for each of its settings, for messages."""
        paths = [("cases", case, *it) if it[0] == "sample" else it for it in leaves(self.settings)]
        return shown_path(self.sheet), dict.fromkeys(paths, self.line)


@dataclass(frozen=True)
class Sheet:
    """All rows of a sheet."""

    path: Path
    """The file."""
    factors: tuple[str, ...]
    """Names of the factors, in the order of their columns."""
    rows: tuple[Row, ...]
    """The rows, in the order of their lines."""
    named: frozenset[tuple[str, str]] = frozenset()
    """Keys and names of the blocks of the config that rows name."""


@dataclass(frozen=True)
class Cell:
    """A cell of a group, with its traces."""

    name: str
    """Name in the sheet."""
    group: str
    """Its group: the value of a factor."""
    rows: tuple[Row, ...]
    """Rows of its traces (replicates), sorted by file."""


def read_sheet(path: Path, blocks: NamedBlocks | None = None) -> Sheet:
    """Read a sheet, and check all of it.

    The file is UTF-8 text with a header, separated by comma, semicolon or tab. Lines that are
    empty or start with ``#`` are ignored. Columns are ``file``, relative to the sheet's folder;
    ``cell``, by default the file's name without suffix; config keys of a case, dotted, whose cells
    are YAML or empty; blocks, whose cells are names; and, of any other name, factors.

    Parameters
    ----------
    path
        The file.
    blocks
        Blocks that the config defines by name.

    Raises
    ------
    BiogripError
        With line and column of the first few problems: text that is no table, unknown keys, values
        and names that are not allowed, traces that are no files or occur twice, cells in two
        groups.
    """
    reader = _Reader(read_table(path), blocks or NamedBlocks())
    rows = tuple(reader.rows())
    if reader.problems:
        raise BiogripError(_listed(reader.problems))
    return Sheet(path, tuple(reader.factors), rows, frozenset(reader.named))


def cells_of(sheet: Sheet, by: str | None = None) -> tuple[str, list[Cell]]:
    """Return the factor that makes groups, and the cells in the order of their first rows.

    Parameters
    ----------
    sheet
        The sheet.
    by
        Name of the factor; by default ``group``, or the only one.

    Raises
    ------
    BiogripError
        If there is no such factor, a cell has no value of it, or a cell is in two groups.
    """
    factor = _factor(sheet, by)
    by_cell: dict[str, list[Row]] = {}
    problems = []
    for row in sheet.rows:
        own = by_cell.setdefault(row.cell, [])
        own.append(row)
        if not row.factors[factor]:
            where = place(sheet.path, row.line, factor)
            problems.append(f"{where}: found nothing, allowed is a name.")
        problems += _in_two_groups(sheet.path, row, own[0], factor)
    if problems:
        raise BiogripError(_listed(problems))
    return factor, [
        Cell(name, rows[0].factors[factor], tuple(sorted(rows, key=lambda row: row.file)))
        for name, rows in by_cell.items()
    ]


def _factor(sheet: Sheet, by: str | None) -> str:
    if by is not None:
        if by not in sheet.factors:
            allowed = ", ".join(sheet.factors) or "a sheet with a column for it"
            raise BiogripError(
                f"--by: found '{by}', which is no factor of {place(sheet.path)}."
                f"{nearest(by, sheet.factors)} Allowed: {allowed}."
            )
        return by
    if GROUP in sheet.factors:
        return GROUP
    if len(sheet.factors) == 1:
        return sheet.factors[0]
    if sheet.factors:
        raise BiogripError(
            f"{place(sheet.path)}: found no column '{GROUP}' but the factors "
            f"{', '.join(sheet.factors)}; allowed is to name one with --by."
            f"{nearest(GROUP, sheet.factors)}"
        )
    raise BiogripError(
        f"{place(sheet.path)}: found no column '{GROUP}', allowed is one, or another factor."
    )


class _Reader:
    """Reader of rows that collects problems."""

    def __init__(self, table: Table, blocks: NamedBlocks) -> None:
        self.problems: list[str] = []
        self.factors: list[str] = []
        self.named: set[tuple[str, str]] = set()
        self._table, self._blocks = table, blocks
        self._settings: dict[str, Setting] = {}
        self._known: dict[tuple[str, str], tuple[Any, str | None]] = {}
        self._files: dict[str, int] = {}
        self._cells: dict[str, Row] = {}
        paths: dict[tuple[str, ...], str] = {}
        for name in table.names:
            if name in (FILE, CELL):
                continue
            setting = setting_of(name)
            if isinstance(setting, str):
                self._add(table.header_line, name, setting)
            elif setting is None:
                self.factors.append(name)
            elif (twin := paths.setdefault(setting.path, name)) != name:
                self._add(table.header_line, name, f"says the same as '{twin}'; allowed is one.")
            else:
                self._settings[name] = setting

    def rows(self) -> Iterator[Row]:
        """Yield rows; those with problems are incomplete."""
        for line in self._table.lines:
            if line.problem:
                self.problems.append(line.problem)
                continue
            row = self._row(line)
            self._check_file(row, line)
            if CELL not in self._table.names:
                before = self._cells.setdefault(row.cell, row)
                if before is not row:
                    text = f"names the cell '{row.cell}' as line {before.line} does; allowed is a "
                    self._add(row.line, FILE, f"{text}column '{CELL}' that says which is which.")
            elif GROUP in self.factors:
                before = self._cells.setdefault(row.cell, row)
                self.problems += _in_two_groups(self._table.path, row, before, GROUP)
            yield row

    def _row(self, line: Line) -> Row:
        cells = line.cells
        for name in (FILE, CELL):
            if not cells.get(name, name):
                self._add(line.number, name, "found nothing, allowed is a name.")
        file = self._table.path.parent / cells[FILE]
        # Blocks first: single keys are laid over them.
        settings: Any = {}
        for name, setting in sorted(self._settings.items(), key=lambda it: not it[1].names_block):
            if cells[name]:
                value, problem = self._value(name, setting, cells[name])
                if problem:
                    self._add(line.number, name, problem)
                else:
                    settings = overlaid(settings, nested(setting.path, value))
        factors = {name: cells[name] for name in self.factors}
        own = cells.get(CELL, file.stem)
        return Row(self._table.path, line.number, file, own, factors, settings)

    def _value(self, name: str, setting: Setting, text: str) -> tuple[Any, str | None]:
        if (name, text) not in self._known:
            self._known[name, text] = (
                self._block(name, text) if setting.names_block else setting.value(text)
            )
        return self._known[name, text]

    def _block(self, key: str, name: str) -> tuple[Any, str | None]:
        allowed = self._blocks.of(key)
        if name in allowed:
            self.named.add((key, name))
            return allowed[name], None
        if not allowed:
            text = f"found {shown(name)}, allowed are names of blocks under blocks.{key} in the "
            return None, f"{text}config, which has none."
        hint = nearest(name, allowed)
        return None, f"found {shown(name)}.{hint} Allowed: {', '.join(allowed)}."

    def _check_file(self, row: Row, line: Line) -> None:
        if not line.cells[FILE]:
            return
        # Compare resolved paths, so that links are detected.
        real = os.path.realpath(row.file)
        if (before := self._files.setdefault(real, row.line)) != row.line:
            text = f"found '{row.file}' again, as on line {before}; allowed is each trace once."
            self._add(row.line, FILE, text)
        elif len(self.problems) < MOST_SHOWN:
            # Names that are near are searched for as long as they are shown.
            if problem := trace_file_problem(row.file):
                self._add(row.line, FILE, problem)
        elif not os.path.isfile(row.file):
            self._add(row.line, FILE, "is no file.")

    def _add(self, line: int, column: str, text: str) -> None:
        self.problems.append(f"{place(self._table.path, line, column)}: {text}")


def _in_two_groups(path: Path, row: Row, first: Row, factor: str) -> list[str]:
    found, before = row.factors[factor], first.factors[factor]
    if found == before:
        return []
    return [
        f"{place(path, row.line, factor)}: found '{found}' for the cell '{row.cell}', which is of "
        f"'{before}' on line {first.line}; allowed is one group for a cell, or another name of the "
        "cell."
    ]


def _listed(problems: list[str]) -> str:
    more = len(problems) - MOST_SHOWN
    return "\n".join(problems[:MOST_SHOWN] + ([f"... and {more} more."] if more > 0 else []))
