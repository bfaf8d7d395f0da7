"""How files are written, atomically, and read again: CSV with a header, and JSON; digests of files.

Text that a spreadsheet would take for a formula is written to CSV with an apostrophe before it, and
read without. A reader raises a `BiogripError` that names a file which is missing, damaged or of
another kind. Cells of a CSV file may be edited; its lines have to be whole.
"""

import csv
import hashlib
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from io import StringIO
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from biogrip import __version__
from biogrip.errors import BiogripError
from biogrip.terminal import unfinished, visible

# A cell that a spreadsheet takes for a formula, and signed numbers, which it does not.
_FORMULA = re.compile(r"'*[=+@\t\r-]")
_SIGNED = re.compile(r"[+-]\d+(\.\d+)?(e[+-]?\d+)?|-(inf)?")
# With this end of a line, `csv` puts quotes around both of its characters in a cell.
_END = "\r\n"
AGAIN = "It is damaged: the same command with --forcerun and this file makes it again."
"""What to do about a result that is not as it was written."""


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a scratch path beside `path`, and move it into place if no error occurs.

    After a loss of power there is the old file or the new one, whole.

    If the file cannot be written, it is a `BiogripError`.
    """
    scratch = scratch_path(path)
    unfinished.add(str(scratch))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for left in left_in(path.parent, ".*.[0-9]*.part"):
            # What has another name may be another machine's, which goes on.
            if left.name.startswith(f".{path.name}."):
                left.unlink(missing_ok=True)
        # A link that somebody has put there is not followed.
        scratch.unlink(missing_ok=True)
        scratch.touch(exist_ok=False)
        yield scratch
        _to_disk(scratch)
        os.replace(scratch, path)
        # Not every system of files does this for a folder.
        with suppress(OSError):
            _to_disk(path.parent)
    except OSError as error:
        raise BiogripError(
            f"{visible(path)}: cannot be written: {error.strerror or error}."
        ) from error
    finally:
        # The error is reported already.
        with suppress(OSError):
            scratch.unlink(missing_ok=True)
        unfinished.discard(str(scratch))


def _to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    opened = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def scratch_path(path: Path) -> Path:
    """Return the scratch path of a file, unique to this process."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


@cache
def left_in(folder: Path, pattern: str) -> list[Path]:
    """Return what killed processes have left, whose number stands before the last dot."""
    every = folder.glob(pattern) if os.path.exists("/proc/self") else ()
    return [it for it in every if not os.path.exists(f"/proc/{it.name.split('.')[-2]}")]


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with atomic_write(path) as scratch:
        scratch.write_text(text, encoding="utf-8", newline="\n")


def digest_of(file: Path) -> str:
    """Return a digest of what is in a file; nothing if it is not there."""
    if not file.is_file():
        return ""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()[:12]


@cache
def software(*others: Path) -> dict[str, str]:
    """Return versions of what computes results, and a digest of the source in our folders."""
    source = "".join(
        f"{file.relative_to(folder)} {digest_of(file)}\n"
        for folder in (Path(__file__).parent, *others)
        for file in sorted(folder.rglob("*"))
        if file.suffix in (".py", ".yaml", ".j2", ".css", ".js")
    )
    digest = hashlib.sha256(source.encode()).hexdigest()[:12]
    versions = {name: version(name) for name in ("numpy", "scipy")}
    return {"biogrip": __version__, **versions, "source": digest}


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
