"""How files between rules are written and read: CSV with a header, arrays of NumPy, JSON.

They are written atomically. Text that a spreadsheet would take for a formula is written to CSV with
an apostrophe before it, and read without. A reader raises a `BiogripError` that names a file which
is missing, damaged or of another kind. Cells of a CSV file may be edited; its lines have to be
whole, and its rows all that whoever reads it knows of.
"""

import csv
import hashlib
import json
import re
import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import chain, product
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import atomic_write, write_text

if TYPE_CHECKING:
    import pandas as pd

# pandas is imported by what needs it: it takes half of the time that a short job has.

# A cell that a spreadsheet takes for a formula, and signed numbers, which it does not.
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_SIGNED = re.compile(r"[+-]\d+(\.\d+)?(e[+-]?\d+)?|-(inf)?")
# With this end of a line, `csv` puts quotes around both of its characters in a cell.
_END = "\r\n"
AGAIN = "It is damaged: delete it, and the same command makes it again."
"""What to do about a result that is not as it was written."""


@dataclass(frozen=True)
class RowFile:
    """A kind of CSV file."""

    what: str
    """Content of a row, for messages."""
    columns: tuple[str, ...] = ()
    """Names of columns; a file may have more."""
    words: tuple[str, ...] | None = ()
    """Columns of text, even if it looks like numbers; None if any may be text."""

    def write(self, path: Path, rows: Iterable[Sequence[Any]]) -> None:
        """Write a header and rows, consuming an iterator row by row."""
        write_rows(path, self.columns, rows)

    def read(self, path: Path, **known: Collection[Any]) -> "pd.DataFrame":
        """Read all rows, which are those of every combination of what is known of columns."""
        import pandas as pd

        text, words = whole(path, self.what), self.words
        try:
            frame = pd.read_csv(StringIO(text, newline=""), dtype=dict.fromkeys(words or (), str))
        except ValueError as error:
            raise BiogripError(
                f"{path}: cannot be read as {self.what}: {error}. {AGAIN}"
            ) from error
        if not {*self.columns} <= {*frame.columns}:
            raise BiogripError(f"{path}, line 1: wanted the columns {', '.join(self.columns)}.")
        for column in frame.columns:
            if frame.empty or pd.api.types.is_numeric_dtype(frame[column]):
                continue
            if words is not None and column not in words:
                raise BiogripError(f"{path}: {column}: not all are numbers. {AGAIN}")
            frame[column] = frame[column].map(as_it_was)
        if known:
            require_rows(path, frame, [*known], product(*known.values()))
        return frame


def write_rows(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows, escaping text that a spreadsheet would take for a formula."""
    with (
        atomic_write(path) as scratch,
        # File names may hold bytes that are not valid text.
        scratch.open("w", encoding="utf-8", errors="backslashreplace", newline="") as stream,
    ):
        lines = SimpleNamespace(write=lambda row: stream.write(row.removesuffix(_END) + "\n"))
        writer = csv.writer(lines, lineterminator=_END)
        for row in chain((columns,), rows):
            cells = [escape_formula(cell) if isinstance(cell, str) else cell for cell in row]
            writer.writerow(cells)


def escape_formula(text: str) -> str:
    """Return text that a spreadsheet takes for no formula; signed numbers stay as they are."""
    return f"'{text}" if _FORMULA.match(text) and not _SIGNED.fullmatch(text) else text


def as_it_was(cell: Any) -> Any:
    """Undo `escape_formula`; anything else is returned unchanged."""
    ours = isinstance(cell, str) and cell[:1] == "'" and _FORMULA.match(cell)
    return cell[1:] if ours else cell


def seeds_of(batch: str) -> range:
    """Return the seeds of a batch, whose name has the first and the last, e.g. ``seeds_0-24``."""
    first, last = map(int, batch.removeprefix("seeds_").split("-"))
    return range(first, last + 1)


def whole(path: Path, what: str = "a table", again: str = f" {AGAIN}") -> str:
    """Return the text of a CSV file, in which each row must have all cells.

    The last line must have an end, too, if the same command makes the file again.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            text = stream.read() if again else stream.read().rstrip("\r\n") + "\n"
        if "\0" in text:
            raise ValueError("found a byte of 0")
        widths = [len(row) for row in csv.reader(StringIO(text, newline=""), strict=True)]
    except (OSError, ValueError, csv.Error) as error:
        raise BiogripError(f"{path}: cannot be read as {what}: {error}.{again}") from error
    short = [line for line, width in enumerate(widths, start=1) if width != widths[0]]
    if short or not text.endswith("\n"):
        line = short[0] if short else len(widths)
        raise BiogripError(f"{path}, line {line}: part of the line is missing.{again}")
    return text


def require_rows(
    path: Path, frame: "pd.DataFrame", columns: Sequence[str], wanted: Iterable[tuple[Any, ...]]
) -> None:
    """Refuse, by a `BiogripError`, a file without each row that is wanted once, or with others."""
    found, known = [*frame[[*columns]].itertuples(index=False, name=None)], [*wanted]
    if len(found) == len(known) and {*found} == {*known}:
        return
    lacking = [row for row in known if row not in {*found}]
    text = f", and none of {', '.join(map(str, lacking[0]))}" if lacking else ""
    raise BiogripError(f"{path}: found {len(found)} rows, wanted {len(known)}{text}. {AGAIN}")


def read_rows(path: Path, again: str = "") -> list[list[str]]:
    """Read the header and all rows of a file, by default a user's, as text, see `whole`."""
    text = whole(path, again=again)
    return [[*map(as_it_was, row)] for row in csv.reader(StringIO(text, newline=""))]


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the rows of a table as text by column."""
    header, *rows = read_rows(path, f" {AGAIN}")
    return [dict(zip(header, row, strict=True)) for row in rows]


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays of numbers or text as NumPy's npz, whose bytes they alone determine."""
    with atomic_write(path) as scratch, scratch.open("wb") as stream:
        np.savez(stream, **arrays)


def read_arrays(path: Path) -> dict[str, Array]:
    """Read all arrays of an npz."""
    try:
        with path.open("rb") as stream, np.load(stream) as arrays:
            # We write no comments: a length that has become another hides what follows.
            members = arrays.zip.infolist()
            if not members or any(member.comment for member in members):
                raise ValueError("arrays are missing")
            return dict(arrays)
    except (OSError, ValueError, EOFError, RuntimeError, BadZipFile, zlib.error) as error:
        # zipfile finds methods and passwords that we do not use: RuntimeError.
        raise BiogripError(f"{path}: cannot be read: {error}. {AGAIN}") from error


def join_arrays(several: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Join arrays of the same names end to end."""
    return {name: np.concatenate([each[name] for each in several]) for name in several[0]}


def write_object(path: Path, plain: Mapping[str, Any], made_from: str = "") -> None:
    """Write plain data as JSON, with a digest of them and of what they were made from."""
    write_text(path, json.dumps({**plain, "digest": _digest(plain, made_from)}, indent=1) + "\n")


def read_object(path: Path, kind: str, made_from: str = "") -> dict[str, Any]:
    """Read what `write_object` wrote; a `BiogripError` says that it is something else."""
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if found.pop("digest") == _digest(found, made_from):
            return found
        problem = "its digest is another one"
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        problem = str(error)
    raise BiogripError(f"{path}: cannot be read as {kind}: {problem}. {AGAIN}")


def _digest(plain: Mapping[str, Any], made_from: str) -> str:
    return hashlib.sha256(f"{json.dumps(plain)}{made_from}".encode()).hexdigest()[:16]
