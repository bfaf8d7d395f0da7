"""Records of written files, validated like untrusted input.

Files are replaced, removed or published according to records. Paths in them must therefore be
relative, stay inside the folder of the record, and pass through no link.
"""

import hashlib
import json
import os
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path, PurePosixPath

from biogrip.errors import BiogripError

LOGS = "logs"
"""Folder of the logs, inside the results folder."""

SUM_OF_LINES = "sha256_of_the_lines_above"

_SHA256 = re.compile(r"[0-9a-f]{64}")
_SCRATCH = re.compile(r"\..+\.\d+\.part")
_SHOWN = 120
_MOST = 2**63
# As the usual file systems have it, in bytes.
_LONGEST_NAME, _LONGEST_PATH = 255, 4095


@dataclass(frozen=True)
class Record:
    """Record of a file at the time it was written."""

    path: str
    """Path relative to the results folder, with forward slashes."""
    size: int
    """Number of bytes."""
    sha256: str
    """Hash; empty while a log or a scratch file is written."""
    modified_ns: int
    """Modification time of the file."""
    recorded_ns: int
    """Time of this record."""
    settings: str = ""
    """Digest of settings and code that made it; empty if it was not made by a job."""
    inputs: str = ""
    """Digest of its input files."""

    def __post_init__(self) -> None:
        """Refuse values that biogrip does not write."""
        for field in fields(self):
            value = getattr(self, field.name)
            if type(value) is not field.type or (field.type is int and not 0 <= value < _MOST):
                raise ValueError(f"{field.name} is {str(value)[:_SHOWN]!r}")
        if self.sha256 and not _SHA256.fullmatch(self.sha256):
            raise ValueError(f"sha256 is {self.sha256[:_SHOWN]!r}")
        refuse_outside(self.path)

    @property
    def line(self) -> str:
        """The record as a line of JSON."""
        return json.dumps(asdict(self)) + "\n"

    @property
    def is_log(self) -> bool:
        """True for a log."""
        return self.path.startswith(f"{LOGS}/")

    @property
    def is_scratch(self) -> bool:
        """True for a scratch file, which is moved into its place when complete."""
        return _SCRATCH.fullmatch(PurePosixPath(self.path).name) is not None


def refuse_outside(path: str) -> None:
    """Refuse a path that is absolute or leaves its folder.

    Raises
    ------
    ValueError
        Names the path and what is allowed.
    """
    if len(path.encode()) > _LONGEST_PATH:
        raise ValueError(f"path is {path[:_SHOWN]!r}..., allowed are {_LONGEST_PATH} bytes")
    parts = PurePosixPath(path).parts
    plain = parts and PurePosixPath(path).as_posix() == path and "\0" not in path
    if not plain or ".." in parts or path.startswith("/") or _too_long(parts):
        raise ValueError(f"path is {path[:_SHOWN]!r}, allowed is a relative one that stays inside")


def _too_long(parts: Iterable[str]) -> bool:
    return any(len(part.encode()) > _LONGEST_NAME for part in parts)


def read_journal(file: Path) -> list[Record]:
    """Read the records of one process, ignoring a last line cut off by a kill.

    Raises
    ------
    BiogripError
        Names file and line that biogrip did not write.
    """
    found = []
    lines = _bytes(file).split(b"\n")
    for number, line in enumerate(lines, start=1):
        try:
            found.append(_record(line))
        except ValueError as error:
            if number < len(lines):
                raise _foreign(file, number, error) from error
    return found


def read_manifest(file: Path) -> list[Record] | None:
    """Return the records of a manifest, [] if there is none, or None if it is damaged.

    Raises
    ------
    BiogripError
        Names file and line that biogrip did not write.
    """
    if not os.path.lexists(file):
        return []
    text, last = _divided(_bytes(file))
    if last != hash_lines(text).encode():
        return None
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            found.append(_record(line))
        except ValueError as error:
            raise _foreign(file, number, error) from error
    return found


def _divided(text: bytes) -> tuple[bytes, bytes]:
    """Split off the last line."""
    start = text.rstrip(b"\n").rfind(b"\n") + 1
    return text[:start], text[start:]


def hash_lines(text: bytes) -> str:
    """Return the last line of a manifest, which has the hash of all others."""
    return json.dumps({SUM_OF_LINES: hashlib.sha256(text).hexdigest()}) + "\n"


def read_sums(file: Path) -> dict[str, list[str]]:
    """Return hashes by name from a file in the format of ``sha256sum``, {} if there is none.

    Raises
    ------
    BiogripError
        Names file and line that are not in the format.
    """
    if not os.path.lexists(file):
        return {}
    sums: dict[str, list[str]] = {}
    for number, line in enumerate(_bytes(file).splitlines(), start=1):
        try:
            digest, blanks, name = line.decode().partition("  ")
            if not (blanks and _SHA256.fullmatch(digest)):
                raise ValueError(f"{line.decode()[:_SHOWN]!r} is no hash, two blanks and a name")
            refuse_outside(name)
        except ValueError as error:
            raise _foreign(file, number, error) from error
        sums.setdefault(name, []).append(digest)
    return sums


def _record(line: bytes) -> Record:
    """Return the record in a line of JSON.

    Raises
    ------
    ValueError
        If the line is no record.
    """
    try:
        return Record(**json.loads(line))
    except (TypeError, RecursionError) as error:
        raise ValueError(f"{line[:_SHOWN]!r} is no record") from error


def _bytes(file: Path) -> bytes:
    """Return the content of a file of records, refusing links.

    Raises
    ------
    BiogripError
        If it is a link or not a file.
    """
    if file.is_symlink() or not file.is_file():
        raise BiogripError(
            f"{file}: found a link or a folder, allowed is a file that biogrip wrote. "
            "Nothing was touched. Move it away and try again."
        )
    return file.read_bytes()


def _foreign(file: Path, line: int, error: ValueError) -> BiogripError:
    return BiogripError(
        f"{file}: line {line}: found what biogrip did not write: {error}. Nothing was touched. "
        "Move the file away and try again."
    )
