"""Reads every record of what biogrip wrote, as something that anybody may have written.

A record is followed when files are replaced, removed or published. Its paths are therefore
relative, stay inside the folder that the record is of, and pass through no link.
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
"""Folder of the logs, among the results."""

SUM_OF_LINES = "sha256_of_the_lines_above"

_SHA256 = re.compile(r"[0-9a-f]{64}")
_SCRATCH = re.compile(r"\..+\.\d+\.part")
_SHOWN = 120
_MOST = 2**63


@dataclass(frozen=True)
class Record:
    """A file as it was written.

    Parameters
    ----------
    path
        Where it is, from the results folder on, with forward slashes.
    size, sha256
        Number of bytes, and their hash; an empty hash while a log or a scratch file is written.
    modified_ns
        When its contents were written, in the file system's time.
    recorded_ns
        When this was written down.
    settings
        Digest of the settings and the code that made it; empty if no job of a study did.
    inputs
        Digest of the files that it was made from.
    """

    path: str
    size: int
    sha256: str
    modified_ns: int
    recorded_ns: int
    settings: str = ""
    inputs: str = ""

    def __post_init__(self) -> None:
        """Refuse what biogrip does not write."""
        for field in fields(self):
            value = getattr(self, field.name)
            if type(value) is not field.type or (field.type is int and not 0 <= value < _MOST):
                raise ValueError(f"{field.name} is {value!r}")
        if self.sha256 and not _SHA256.fullmatch(self.sha256):
            raise ValueError(f"sha256 is {self.sha256!r}")
        refuse_outside(self.path)

    @property
    def line(self) -> str:
        """The record as a line of JSON."""
        return json.dumps(asdict(self)) + "\n"

    @property
    def is_log(self) -> bool:
        """Whether it is of a log."""
        return self.path.startswith(f"{LOGS}/")

    @property
    def is_scratch(self) -> bool:
        """Whether it is of a file that is moved into its place when it is whole."""
        return _SCRATCH.fullmatch(PurePosixPath(self.path).name) is not None


def refuse_outside(path: str) -> None:
    """Refuse a path that is absolute or might leave the folder that it is relative to.

    Raises
    ------
    ValueError
        Says what was found and what is allowed.
    """
    path.encode()
    parts = PurePosixPath(path).parts
    plain = parts and PurePosixPath(path).as_posix() == path and "\0" not in path
    if not plain or ".." in parts or path.startswith("/"):
        raise ValueError(f"path is {path!r}, allowed is a relative one that stays inside")


def refuse_links(folder: Path, paths: Iterable[str]) -> None:
    """Refuse paths, from a folder on, that pass through a link.

    Raises
    ------
    BiogripError
        Names the first link.
    """
    above = {parent for path in paths for parent in PurePosixPath(path).parents}
    for place in sorted(folder / parent for parent in above if parent.parts):
        if place.is_symlink():
            raise BiogripError(
                f"{place}: is a link, and nothing is written, replaced or removed through links. "
                "Put a folder or nothing in its place."
            )


def read_journal(file: Path) -> list[Record]:
    """Read the records of one process; a kill may have cut the last line.

    Raises
    ------
    BiogripError
        Names file and line of what biogrip did not write.
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
    """Read a manifest: nothing if there is none, None if it is damaged.

    Raises
    ------
    BiogripError
        Names file and line of a record that biogrip did not write.
    """
    if not os.path.lexists(file):
        return []
    text, last = _divided(_bytes(file))
    if last != sum_of_lines(text).encode():
        return None
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            found.append(_record(line))
        except ValueError as error:
            raise _foreign(file, number, error) from error
    return found


def _divided(text: bytes) -> tuple[bytes, bytes]:
    """Divide off the last line."""
    start = text.rstrip(b"\n").rfind(b"\n") + 1
    return text[:start], text[start:]


def sum_of_lines(text: bytes) -> str:
    """Return the last line of a manifest, with the hash of all others."""
    return json.dumps({SUM_OF_LINES: hashlib.sha256(text).hexdigest()}) + "\n"


def read_sums(file: Path) -> dict[str, list[str]]:
    """Read hashes by name that ``sha256sum`` can check, from a file that need not exist.

    Raises
    ------
    BiogripError
        Names file and line of what is no name and hash.
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
    """Read a line of JSON.

    Raises
    ------
    ValueError
        If it is no record.
    """
    try:
        return Record(**json.loads(line))
    except (TypeError, RecursionError) as error:
        raise ValueError(f"{line[:_SHOWN]!r} is no record") from error


def _bytes(file: Path) -> bytes:
    """Read a file of records, which is no link.

    Raises
    ------
    BiogripError
        If it is.
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
