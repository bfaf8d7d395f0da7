"""Reader of recorded traces in the user's own CSV, with gaps, units and line numbers."""

import csv
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import combinations, islice
from pathlib import Path
from unicodedata import normalize

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest
from biogrip.instrument.gripper import ROTATION
from biogrip.instrument.instrument import Quantity
from biogrip.terminal import visible

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}

FEWEST_SAMPLES = 10
MOST_ROWS = 10_000_000

# Relative to the last time: smaller steps are damaged numbers, not a clock's.
_SHORTEST_STEP = 1e-18

_SPELLED_OUT = {
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "min": ("mins", "minute", "minutes", "m"),
    "h": ("hr", "hrs", "hour", "hours"),
    "rad": ("radian", "radians"),
    "mrad": ("milliradian", "milliradians"),
    "urad": ("microrad", "microradian", "microradians"),
    "deg": ("degree", "degrees"),
}
_SEPARATORS = (",", ";", "\t")
_GAPS = ("", "-", "na", "n/a", "nan", "#n/a", "#nv")
_ROWS_AT_ONCE = 100_000
_MOST_LISTED = 50
# Lines among which a header is looked for, where the first has not the columns.
_LONGEST_PREAMBLE = 200
# Spreadsheet errors like #REF!, #DIV/0! or #NAME? followed by a separator are cells, not comments.
_COMMENT = re.compile(r" *#(?!(?:[A-Z0-9/_]+[!?]|N/A|NV)\s*[,;\t])")
_UNIT_AT_END = re.compile(r"(?:_(\w+)|\(([^()]*)\)|\[([^\[\]]*)\])$")


@dataclass(frozen=True)
class Columns:
    """Names and units of the columns of a trace."""

    time: str
    """Name of the column of times."""
    reading: str
    """Name of that of what the instrument reads."""
    time_unit: str | None = None
    """Key of `TIME_UNITS`; None if the column's name ends with the unit."""
    reading_unit: str | None = None
    """Key of the quantity's units, likewise."""
    skip: int = 0
    """Number of lines before the header."""
    scale: float = 1.0
    """Reading in its unit over the number in the column."""
    start_s: float | None = None
    """Time of the clock at which the protocol starts, if it is known."""
    by_options: bool = False
    """True if command-line options set them, false for config keys; used in messages."""
    sd: str | None = None
    """Name of the column of the readings' standard deviations, in their unit, if there is one."""
    quantity: Quantity = ROTATION
    """What is read."""

    @property
    def unit_key(self) -> str:
        """The key that says the unit of the readings."""
        return "rotation_unit" if self.quantity == ROTATION else "reading_unit"

    @property
    def named(self) -> dict[str, str]:
        """Names of the columns by the key that says them, in the order of reading."""
        names = {"time": self.time, self.quantity.name: self.reading}
        return names if self.sd is None else {**names, "sd": self.sd}


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


@dataclass(frozen=True)
class _Layout:
    """Layout of a file, as its header tells it."""

    separator: str
    """Cell separator."""
    width: int
    """Number of columns."""
    indices: dict[str, int]
    """Indices of the columns to read by name, in the order of reading."""


def read_recording(path: Path, columns: Columns) -> Recording:
    """Read a recorded trace.

    The file is text in UTF-8, in UTF-16 with a byte order mark, or else in Windows-1252, as older
    programs write it, with any usual line ends. The first ``skip`` lines are ignored, and so are
    empty lines and lines that start with ``#``. The first other line is the header, which decides
    the separator: comma, semicolon or tab. With the last two, numbers may have a decimal comma.
    Cells may be quoted and padded with blanks, but a quoted cell ends on its line. Other columns
    may hold anything.

    The unit is that of `columns`, or else the end of the column's name, as in ``rotation_urad``,
    ``phi (mrad)`` or ``time [s]``; it is never guessed. The micro sign may replace the u.

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
        If the file cannot be read as text, lacks a column or repeats it, its unit is unknown or
        contradicts the name, a row has too few or too many cells, or text that is neither a finite
        number nor a gap, a standard deviation is not positive, the time does not increase, or there
        are fewer than `FEWEST_SAMPLES` samples or more than `MOST_ROWS` rows.
    """
    try:
        if not path.is_file():
            other = "no regular file" if path.exists() else "no file"
            found = "a directory" if path.is_dir() else other
            raise BiogripError(
                f"{place(path)}: found {found}, allowed is a text file with a trace."
            )
        sizes, values, lines = _read_text(path, columns)
    except UnicodeDecodeError as error:
        # Windows-1252 is read last, and Python calls it a charmap.
        encoding = "utf-16" if error.encoding.startswith("utf-16") else "cp1252"
        raise BiogripError(_not_text(path, encoding)) from error
    except OSError as error:
        raise BiogripError(f"{place(path)}: cannot be read: {error.strerror}.") from error
    gaps = np.any(np.isnan(values), axis=1)
    kept, kept_lines = values[~gaps], lines[~gaps]
    without_number = len(lines) - len(kept_lines)
    _check_count(path, columns, len(kept), without_number)
    _check_order(path, columns, kept[:, 0], kept_lines)
    if columns.sd is not None:
        _check_positive(path, columns.sd, kept[:, 2], kept_lines)
    factors = sizes * np.array([1.0, columns.scale, abs(columns.scale)][: len(sizes)])
    time_s, rotation_rad, *sd_rad = (own * size for own, size in zip(kept.T, factors, strict=True))
    return Recording(time_s, rotation_rad, kept_lines, without_number, *sd_rad)


def place(path: Path, line: int | None = None, column: str | None = None) -> str:
    """Return the file, line and column at the beginning of a message."""
    where = visible(path)
    if line is not None:
        where += f", line {line}"
    if column is not None:
        where += f", column '{visible(column)}'"
    return where


def unit_of(
    path: Path,
    column: str,
    given: str | None,
    allowed: Mapping[str, float],
    key: str,
    *,
    by_options: bool = False,
) -> str:
    """Return the unit of a column, a key of `allowed`.

    Parameters
    ----------
    path
        The file, for messages.
    column
        Name of the column; it may end with the unit.
    given
        Unit that the user states, or None.
    allowed
        Allowed units; if ``1`` is among them, none need be given.
    key
        Key or option that states the unit, for messages.
    by_options
        Field of `Columns`.

    Raises
    ------
    BiogripError
        If no allowed unit is given, or name and statement contradict each other.
    """
    choices = ", ".join(allowed)
    named = _unit_at_end(column, allowed)
    stated = named if given is None else _plain(given)
    if stated is None and "1" in allowed:
        return "1"
    if stated is None:
        raise BiogripError(
            f"{place(path, column=column)}: found no unit, neither stated (by "
            f"{_said_by(by_options, key)}) nor at the end of the name; allowed are "
            f"{choices}."
        )
    if stated not in allowed:
        raise BiogripError(
            f"{place(path, column=column)}: found the unit '{given}', allowed are {choices}."
            + nearest_unit(given, allowed)
        )
    if named not in (None, stated):
        raise BiogripError(
            f"{place(path, column=column)}: found the unit '{given}' where the name says "
            f"'{named}', allowed is one unit."
        )
    return stated


def _said_by(by_options: bool, *names: str) -> str:
    """Return the options or config keys that set something, for messages."""
    if by_options:
        return " and ".join(f"--{name.replace('_', '-')}" for name in names)
    return f"{' and '.join(names)} under measurement"


def nearest_unit(name: object, allowed: Collection[str]) -> str:
    """Return a hint like ``" Did you mean 'h'?"`` for ``hours``; otherwise that of `nearest`."""
    plain = _plain(str(name)).lower()
    for unit in allowed:
        if plain in _SPELLED_OUT.get(unit, ()):
            return f" Did you mean '{unit}'?"
    return nearest(name, allowed)


def _unit_at_end(column: str, allowed: Mapping[str, float]) -> str | None:
    ending = _UNIT_AT_END.search(_plain(column))
    if ending is None:
        return None
    # A name may end with something other than a unit, as in rotation_left or phi (2).
    unit = next(group for group in ending.groups() if group is not None).strip()
    before, _, last = unit.rpartition("_")
    last = f"1/{last}" if before.endswith("per") else last
    return next((u for u in allowed if u in (unit, last)), None)


def _plain(name: str) -> str:
    """Return a name without padding, with either micro sign written as u, and ° as deg."""
    return normalize("NFKC", name).strip().replace("\u03bc", "u").replace("°", "deg")


def _read_text(path: Path, columns: Columns) -> tuple[Array, Array, IntArray]:
    """Read a file as `_read` does, in the encoding that it seems to have."""
    with path.open("rb") as content:
        marked = content.read(2) in (BOM_UTF16_LE, BOM_UTF16_BE)
    try:
        with path.open(encoding="utf-16" if marked else "utf-8-sig", newline="") as stream:
            return _read(path, stream, columns)
    except UnicodeDecodeError:
        if marked:
            raise
    with path.open(encoding="cp1252", newline="") as stream:
        return _read(path, stream, columns)


def _read(path: Path, stream: Iterator[str], columns: Columns) -> tuple[Array, Array, IntArray]:
    """Read unit factors to SI units, (n,), numbers, (n_rows, n), and line numbers.

    The columns are time, reading and standard deviation, in the file's units, with NaN for gaps.
    """
    at: list[int] = []
    lines = _significant(path, stream, at, columns.skip)
    layout = _layout(path, lines, at, columns)
    allowed, key = columns.quantity.units, columns.unit_key
    time_unit, unit = (
        unit_of(path, column, given, units, said_by, by_options=columns.by_options)
        for column, given, units, said_by in (
            (columns.time, columns.time_unit, TIME_UNITS, "time_unit"),
            (columns.reading, columns.reading_unit, allowed, key),
        )
    )
    sizes = np.array([TIME_UNITS[time_unit], allowed[unit]])
    if columns.sd is not None:
        sizes = np.append(sizes, allowed[unit_of(path, columns.sd, unit, allowed, key)])
    from biogrip.traces.plain_rows import plain_rows  # Arrow takes as long as a short job.

    plain = plain_rows(path, at[0], layout.width, [*layout.indices.values()], layout.separator)
    if plain is not None and len(plain) <= MOST_ROWS:
        return sizes, plain, at[0] + 1 + np.arange(len(plain))
    values, row_lines = [np.zeros((0, len(sizes)))], [np.zeros(0, np.int64)]
    for rows in _blocks(path, lines, layout.separator, at):
        _check_rows(path, at, rows, layout)
        cells = {name: [row[i] for row in rows] for name, i in layout.indices.items()}
        numbers = [_numbers(path, at, name, cells[name], layout.separator) for name in cells]
        values.append(np.stack(numbers, axis=1))
        row_lines.append(np.array(at))
    return sizes, np.concatenate(values), np.concatenate(row_lines)


def _significant(path: Path, stream: Iterator[str], at: list[int], skip: int) -> Iterator[str]:
    """Yield lines that are neither empty nor comments, appending their numbers to `at`."""
    for number, line in islice(enumerate(stream, 1), skip, None):
        if "\0" in line:
            raise BiogripError(f"{place(path, number)}: found binary data, allowed is text.")
        if line.strip(" \r\n") and not _COMMENT.match(line):
            at.append(number)
            yield line


def _layout(path: Path, lines: Iterator[str], at: list[int], columns: Columns) -> _Layout:
    header = next(lines, None)
    if header is None:
        raise BiogripError(f"{place(path)}: found no header, allowed is a line with column names.")
    needed = columns.named
    separator, names = _header(path, at[0], header, list(needed.values()))
    which = _said_by(columns.by_options, *needed)
    try:
        indices = [_index(path, at[0], names, column, which) for column in needed.values()]
    except BiogripError as error:
        first = [header, *islice(lines, _LONGEST_PREAMBLE)]
        raise BiogripError(f"{error}{_later_header(path, first, at, columns)}") from error
    for (one, i), (other, j) in combinations(zip(needed, indices, strict=True), 2):
        if i == j:
            raise BiogripError(
                f"{place(path, at[0], needed[one])}: found {one} and {other} in one column, "
                "allowed are two."
            )
    return _Layout(separator, len(names), dict(zip(needed.values(), indices, strict=True)))


def _header(path: Path, at: int, line: str, needed: Sequence[str]) -> tuple[str, list[str]]:
    """Return the separator that yields most wanted columns, then most columns, and the names."""
    readings = {}
    for separator in _SEPARATORS:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise BiogripError(f"{place(path, at)}: cannot be read as a row: {error}.") from error
        readings[separator] = [cell.strip() for cell in cells]
    plain = {_plain(name) for name in needed}

    def merit(separator: str) -> tuple[int, int]:
        names = readings[separator]
        return len(plain & set(map(_plain, names))), len(names)

    separator = max(readings, key=merit)
    return separator, readings[separator]


def _later_header(path: Path, lines: list[str], at: list[int], columns: Columns) -> str:
    """Return a hint on the first line that names the columns, or has numbers below its names."""
    needed = [*columns.named.values()]
    rows = [_header(path, *row, needed)[1] for row in zip(at, lines, strict=True)]
    for line, names, below in zip(at, rows, [*rows[1:], []], strict=True):
        named = {*map(_plain, needed)} <= {*map(_plain, names)}
        if named or (len(names) == len(below) > 1 and _numeric(below) > _numeric(names) == 0):
            how = f"--skip {line - 1}" if columns.by_options else f"skip: {line - 1} there"
            return f" Line {line} looks like the header: {how}." if line > at[0] else ""
    return ""


def _numeric(cells: list[str]) -> int:
    """Count cells that are numbers, with a decimal point or comma."""
    found = (_number_or_inf(cell.replace(",", ".")) for cell in cells)
    return sum(bool(np.isfinite(number)) for number in found)


def _index(path: Path, line: int, names: list[str], column: str, which: str) -> int:
    indices = [i for i, name in enumerate(names) if _plain(name) == _plain(column)]
    if not indices:
        raise BiogripError(
            f"{place(path, line, column)}: found no such column, allowed are {_listed(names)}."
            f"{nearest(column, names)} Say which is which by {which}."
        )
    if len(indices) > 1:
        raise BiogripError(
            f"{place(path, line, column)}: found {len(indices)} columns of this name, "
            "allowed is one."
        )
    return indices[0]


def _blocks(
    path: Path, lines: Iterator[str], separator: str, at: list[int]
) -> Iterator[list[list[str]]]:
    """Yield the rows in blocks, with `at` holding the line numbers of the current block."""
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    count = 0
    while True:
        at.clear()
        rows = list(islice(_one_per_line(path, reader, at), _ROWS_AT_ONCE))
        count += len(rows)
        if count > MOST_ROWS:
            raise BiogripError(
                f"{place(path)}: found over {MOST_ROWS} rows, allowed are {MOST_ROWS}."
            )
        if not rows:
            return
        yield rows


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


def _check_rows(path: Path, at: list[int], rows: list[list[str]], layout: _Layout) -> None:
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
        values = np.array([_number_or_inf(text) for text in texts])
    for row in np.flatnonzero(np.isinf(values))[:1]:
        raise BiogripError(
            f"{place(path, at[row], column)}: found '{_shortened(cells[row])}', allowed is a "
            "finite number, or nan, NA, N/A, - or nothing where there is none."
        )
    return values


def _number_or_inf(text: str) -> float:
    """Return a cell's number, NaN for a gap, and inf for anything else."""
    word = text.strip().lower()
    if word in _GAPS:
        return np.nan
    try:
        return np.inf if "_" in word else float(word)
    except ValueError:
        return np.inf


def _shortened(cell: str) -> str:
    return cell if len(cell) <= 40 else cell[:40] + "..."


def _listed(names: list[str]) -> str:
    listed = ", ".join(map(_shortened, names[:_MOST_LISTED]))
    return listed if len(names) <= _MOST_LISTED else f"{listed} and {len(names)} in all"


def _all(columns: Columns) -> str:
    *names, last = columns.named.values()
    return f"{'both ' if len(names) == 1 else ''}{', '.join(names)} and {last}"


def _check_count(path: Path, columns: Columns, found: int, without_number: int) -> None:
    if found < FEWEST_SAMPLES:
        gaps = f" ({counted(without_number, 'row')} with NaN)" if without_number else ""
        raise BiogripError(
            f"{place(path)}: found {counted(found, 'row')} with a number in {_all(columns)}{gaps}, "
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
        raise BiogripError(
            f"{place(path, lines[row + 1], columns.time)}: found {found} "
            f"(line {lines[row]}), allowed are times that increase{by}."
        )


def _not_text(path: Path, encoding: str) -> str:
    """Return a message with the line of the first byte that is no text."""
    content = path.read_bytes()
    try:
        content.decode(encoding)
    except UnicodeDecodeError as error:
        before = StringIO(content[: error.start].decode(encoding) + "?", newline="")
        line, byte = sum(1 for _ in before), content[error.start]
        return (
            f"{place(path, line)}: found the byte 0x{byte:02x}, allowed is text in UTF-8, UTF-16 "
            "or Windows-1252."
        )
    return f"{place(path)}: changed while it was read."
