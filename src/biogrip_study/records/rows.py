"""How files between rules are written and read: CSV with a header, and arrays of NumPy.

The rows of a file are all that whoever reads it knows of, see `biogrip.files`.
"""

import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import AGAIN, as_it_was, atomic_write, whole, write_rows

if TYPE_CHECKING:
    import pandas as pd

# pandas is imported by what needs it: it takes half of the time that a short job has.


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
            for name, cells in frame.items():
                is_text = words is None or name in words
                frame[name] = cells.map(as_it_was) if is_text else pd.to_numeric(cells)
        except ValueError as error:
            raise BiogripError(
                f"{path}: cannot be read as {self.what}: {error}. {AGAIN}"
            ) from error
        if not {*self.columns} <= {*frame.columns}:
            raise BiogripError(f"{path}, line 1: wanted the columns {', '.join(self.columns)}.")
        rows = [*frame[[*known]].itertuples(index=False, name=None)]
        wanted = [*product(*known.values())] if known else rows
        if len(rows) != len(wanted) or {*rows} != {*wanted}:
            lacking = [row for row in wanted if row not in {*rows}]
            text = f", and none of {', '.join(map(str, lacking[0]))}" if lacking else ""
            raise BiogripError(
                f"{path}: found {len(rows)} rows, wanted {len(wanted)}{text}. {AGAIN}"
            )
        return frame


def seeds_of(batch: str) -> range:
    """Return the seeds of a batch, whose name has the first and the last, e.g. ``seeds_0-24``."""
    first, last = map(int, batch.removeprefix("seeds_").split("-"))
    return range(first, last + 1)


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
    return {name: np.concatenate([arrays[name] for arrays in several]) for name in several[0]}
