"""What one process writes into the results, noted before it is in its place.

Each process has a file of its own, a line a file, so that writing it needs no
lock on any file system, and that whatever is killed, no file of the study is
without its record.
"""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from biogrip.files import watched

JOURNALS = ".manifest"
"""Folder of the journals, among the results."""


@dataclass(frozen=True)
class Record:
    """A file as it was written.

    Parameters
    ----------
    path
        Where it is, from the results folder on, with forward slashes.
    size, sha256
        Number of bytes, and their hash; of a log, which grows, an empty one.
    modified_ns
        When its contents were written, in the file system's time.
    recorded_ns
        When this was written down.
    """

    path: str
    size: int
    sha256: str
    modified_ns: int
    recorded_ns: int


class Journal:
    """What one process writes into a results folder.

    Parameters
    ----------
    results
        The results folder.
    """

    def __init__(self, results: Path) -> None:
        self._results = results.absolute()
        name = f"{os.uname().nodename}--{os.getpid()}--{time.time_ns()}.jsonl"
        self._file = self._results / JOURNALS / name

    def note(self, path: Path, content: Path) -> None:
        """Write down that `path` is about to be what `content` is now.

        A path outside the results folder is nobody's to record.
        """
        whole = path.absolute()
        if whole.is_relative_to(self._results):
            stat = content.stat()
            self._append(
                Record(
                    whole.relative_to(self._results).as_posix(),
                    stat.st_size,
                    sha256_of(content),
                    stat.st_mtime_ns,
                    time.time_ns(),
                )
            )

    def note_logs(self, paths: Iterable[Path]) -> None:
        """Write down that logs are about to be written."""
        for path in paths:
            name = path.absolute().relative_to(self._results).as_posix()
            self._append(Record(name, 0, "", 0, time.time_ns()))

    def _append(self, record: Record) -> None:
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(record)) + "\n")


@contextmanager
def recorded_in(results: Path) -> Iterator[None]:
    """Record every file that is written whole below a results folder meanwhile."""
    with watched(Journal(results).note):
        yield


def sha256_of(path: Path) -> str:
    """Hash of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
