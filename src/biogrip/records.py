"""How files are written that are read again: CSV with a header, and JSON.

They are written atomically. Text that a spreadsheet would take for a formula is written to CSV with
an apostrophe before it, and read without. A reader raises a `BiogripError` that names a file which
is missing, damaged or of another kind. Cells of a CSV file may be edited; its lines have to be
whole.
"""

import csv
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from biogrip.errors import BiogripError
from biogrip.files import atomic_write, write_text

# A cell that a spreadsheet takes for a formula, and signed numbers, which it does not.
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_SIGNED = re.compile(r"[+-]\d+(\.\d+)?(e[+-]?\d+)?|-(inf)?")
# With this end of a line, `csv` puts quotes around both of its characters in a cell.
_END = "\r\n"
AGAIN = "It is damaged: the same command with --forcerun and this file makes it again."
"""What to do about a result that is not as it was written."""


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


def read_rows(path: Path, again: str = "") -> list[list[str]]:
    """Read the header and all rows of a file, by default a user's, as text, see `whole`."""
    text = whole(path, again=again)
    return [[*map(as_it_was, row)] for row in csv.reader(StringIO(text, newline=""))]


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the rows of a table as text by column."""
    header, *rows = read_rows(path, f" {AGAIN}")
    return [dict(zip(header, row, strict=True)) for row in rows]


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
