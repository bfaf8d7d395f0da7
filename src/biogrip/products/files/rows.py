"""Files of rows: CSV with a header, written whole, and read with the message that fits."""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip.errors import BiogripError
from biogrip.files import written_whole

if TYPE_CHECKING:
    import pandas as pd


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
    """Write a header and rows, as they come."""
    with written_whole(path) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


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
    return frame


def read_rows(path: Path, wanted: Sequence[str] | None = None) -> list[list[str]]:
    """Read the header and all rows as text.

    Raises
    ------
    BiogripError
        If the file cannot be read, or its header is not the wanted one.
    """
    try:
        with path.open(newline="") as stream:
            rows = list(csv.reader(stream))
    except (OSError, ValueError, csv.Error) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error
    if not rows:
        raise BiogripError(f"{path}: is empty.")
    if wanted is not None and rows[0] != list(wanted):
        raise BiogripError(f"{path}, line 1: found {','.join(rows[0])}; wanted {','.join(wanted)}.")
    return rows
