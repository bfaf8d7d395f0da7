"""How files between rules are written and read: CSV with a header, arrays of NumPy, JSON.

They are written atomically. Text that a spreadsheet would take for a formula is written to CSV with
an apostrophe before it, and read without. A reader raises a `BiogripError` that names a file which
is missing, damaged or of another kind.
"""

import csv
import json
import re
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import atomic_write

if TYPE_CHECKING:
    import pandas as pd

# pandas is imported by what needs it: it takes half of the time that a short job has.

# A cell that a spreadsheet takes for a formula, and signed numbers, which it does not.
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_SIGNED = re.compile(r"[+-]\d+(\.\d+)?(e[+-]?\d+)?|-(inf)?")
# With this end of a line, `csv` puts quotes around both of its characters in a cell.
_END = "\r\n"


@dataclass(frozen=True)
class RowFile:
    """A kind of CSV file."""

    what: str
    """Content of a row, for messages."""
    columns: tuple[str, ...]
    """Column names."""
    words: tuple[str, ...] = ()
    """Columns to read as text even if they look like numbers."""

    def write(self, path: Path, rows: Iterable[Sequence[Any]]) -> None:
        """Write a header and rows, consuming an iterator row by row."""
        write_rows(path, self.columns, rows)

    def read(self, path: Path) -> "pd.DataFrame":
        """Read all rows."""
        return read_frame(path, self.what, self.columns, self.words)


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


def read_frame(
    path: Path, what: str, columns: Sequence[str], words: Sequence[str] = ()
) -> "pd.DataFrame":
    """Read rows of a CSV file that have at least the given columns.

    Columns of words are read as text even if they look like numbers; `what` says in messages what
    the file holds.
    """
    import pandas as pd

    try:
        frame = pd.read_csv(path, dtype=dict.fromkeys(words, str))
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as {what}: {error}.") from error
    if not set(columns) <= set(frame.columns):
        raise BiogripError(f"{path}, line 1: wanted the columns {', '.join(columns)}.")
    for column in frame.columns:
        if not pd.api.types.is_numeric_dtype(frame[column]):
            frame[column] = frame[column].map(as_it_was)
    return frame


def read_rows(path: Path, columns: Sequence[str] | None = None) -> list[list[str]]:
    """Read the header, which may have to be given columns, and all rows as text."""
    import pandas as pd

    try:
        frame = pd.read_csv(path, header=None, dtype=str, na_filter=False)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error
    rows: list[list[str]] = frame.map(as_it_was).to_numpy().tolist()
    if columns is not None and rows[0] != list(columns):
        found, wanted = ",".join(rows[0]), ",".join(columns)
        raise BiogripError(f"{path}, line 1: found {found}; wanted {wanted}.")
    return rows


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the rows of a table as text by column."""
    header, *rows = read_rows(path)
    return [dict(zip(header, row, strict=True)) for row in rows]


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays of numbers or text as NumPy's npz, whose bytes they alone determine."""
    with atomic_write(path) as scratch, scratch.open("wb") as stream:
        np.savez(stream, **arrays)


def read_arrays(path: Path) -> dict[str, Array]:
    """Read all arrays of an npz."""
    try:
        with np.load(path) as arrays:
            return dict(arrays)
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error


def join_arrays(several: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Join arrays of the same names end to end."""
    return {name: np.concatenate([each[name] for each in several]) for name in several[0]}


def read_object(path: Path, kind: str, keys: Set[str], lacking: str) -> dict[str, Any]:
    """Read a JSON object of some kind, with a message if one of the required keys is lacking."""
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as {kind}: {error}.") from error
    if not keys <= set(found):
        raise BiogripError(f"{path}: {lacking}.")
    return found
