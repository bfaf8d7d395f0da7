"""Files of rows: CSV with a header, written whole, and read with the message that fits."""

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from biogrip.errors import BiogripError
from biogrip.files import written_whole

if TYPE_CHECKING:
    import pandas as pd


# What a spreadsheet computes as a formula, and what we have written of it.
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_SIGNED = re.compile(r"[+-]\d+(\.\d+)?(e[+-]?\d+)?|-(inf)?")

_END = "\r\n"


@dataclass(frozen=True)
class RowFile:
    """A kind of file.

    Parameters
    ----------
    what
        What its rows are, for messages.
    columns
        Their names.
    path
        Where a case's file is, or that of the study.
    batch_path
        Where those of its batches are, if it is put together from batches.
    words
        Columns that are text, whatever they look like.
    """

    what: str
    columns: tuple[str, ...]
    path: str
    batch_path: str = ""
    words: tuple[str, ...] = ()

    def write(self, path: Path, rows: Iterable[Sequence[Any]]) -> None:
        """Write all rows, as they come."""
        write_rows(path, self.columns, rows)

    def read(self, path: Path) -> "pd.DataFrame":
        """Read all rows.

        Raises
        ------
        BiogripError
            If the file is missing, or is not of this kind.
        """
        return read_frame(path, self.what, self.columns, self.words)


def write_rows(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows, as they come, so that no cell is a formula to a spreadsheet."""
    with (
        written_whole(path) as scratch,
        # Of a file's name, bytes may be no text.
        scratch.open("w", encoding="utf-8", errors="backslashreplace", newline="") as stream,
    ):
        writer = csv.writer(_Lines(stream), lineterminator=_END)
        for row in chain((columns,), rows):
            writer.writerow([inert(cell) if isinstance(cell, str) else cell for cell in row])


class _Lines:
    """Ends lines as we do, where cells with an end of line, of whatever kind, are in quotes."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, row: str) -> None:
        """Write a row."""
        self._stream.write(row.removesuffix(_END) + "\n")


def inert(text: str) -> str:
    """Return text that a spreadsheet takes for no formula, numbers with a sign as they are."""
    return f"'{text}" if _FORMULA.match(text) and not _SIGNED.fullmatch(text) else text


def as_it_was(cell: Any) -> Any:
    """Return the text of which `inert` has made another, and what is no text as it is."""
    ours = isinstance(cell, str) and cell[:1] == "'" and _FORMULA.match(cell)
    return cell[1:] if ours else cell


def read_frame(
    path: Path, what: str, columns: Sequence[str], words: Sequence[str] = ()
) -> "pd.DataFrame":
    """Read rows that have some columns at least.

    Parameters
    ----------
    path
        The file, CSV.
    what
        What it should hold, for messages.
    columns
        What its rows must have.
    words
        Columns that are text, whatever they look like.

    Raises
    ------
    BiogripError
        If the file is missing, is no CSV, or lacks a column.
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


def read_rows(path: Path, wanted: Sequence[str] | None = None) -> list[list[str]]:
    """Read the header and all rows as text.

    Raises
    ------
    BiogripError
        If the file cannot be read, or its header is not the wanted one.
    """
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = [[as_it_was(cell) for cell in row] for row in csv.reader(stream)]
    except (OSError, ValueError, csv.Error) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error
    if not rows:
        raise BiogripError(f"{path}: is empty.")
    if wanted is not None and rows[0] != list(wanted):
        raise BiogripError(f"{path}, line 1: found {','.join(rows[0])}; wanted {','.join(wanted)}.")
    return rows
