"""What one process writes into the results, noted before it is in its place.

Each process has a file of its own, a line a file, so that writing it needs no
lock on any file system, and that whatever is killed, no file of the study is
without its record.
"""

import hashlib
import os
import re
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from biogrip.files import watched
from biogrip.running.records import Record

JOURNALS = ".manifest"
"""Folder of the journals, among the results."""

_NAME = re.compile(r"(?P<host>.+)--(?P<process>\d+)--\d+\.jsonl")
_DAY_S = 86_400.0
_PROCESSES = 2**31


class Journal:
    """What one process writes into a results folder.

    Parameters
    ----------
    results
        The results folder.
    settings, inputs
        What its files are made for and of, see `biogrip.running.records.Record`.
    """

    def __init__(self, results: Path, settings: str = "", inputs: str = "") -> None:
        self._results = results.absolute()
        name = f"{os.uname().nodename}--{os.getpid()}--{time.time_ns()}.jsonl"
        self._file = self._results / JOURNALS / name
        self._made = settings, inputs

    def note(self, path: Path, content: Path) -> None:
        """Write down that `path` is about to be what `content` is now.

        A path outside the results folder is nobody's to record.
        """
        if path.absolute().is_relative_to(self._results):
            self._append(self.record(path, content))

    def record(self, path: Path, content: Path) -> Record:
        """Describe `path`, among the results, with what `content` is now."""
        stat = content.stat()
        return Record(
            path.absolute().relative_to(self._results).as_posix(),
            stat.st_size,
            sha256_of(content),
            stat.st_mtime_ns,
            time.time_ns(),
            *self._made,
        )

    def note_begun(self, paths: Iterable[Path]) -> None:
        """Write down that logs or scratch files are about to be written."""
        for path in paths:
            whole = path.absolute()
            if whole.is_relative_to(self._results):
                name = whole.relative_to(self._results).as_posix()
                self._append(Record(name, 0, "", 0, time.time_ns()))

    def _append(self, record: Record) -> None:
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a", encoding="utf-8") as stream:
            stream.write(record.line)


@contextmanager
def recorded_in(results: Path, settings: str = "", inputs: str = "") -> Iterator[None]:
    """Record every file that is written whole below a results folder meanwhile."""
    journal = Journal(results, settings, inputs)
    with watched(journal.note, lambda scratch: journal.note_begun([scratch])):
        yield


def journals_in(results: Path) -> list[Path]:
    """Journals of a results folder; files with other names are somebody else's."""
    return sorted(file for file in (results / JOURNALS).glob("*") if _NAME.fullmatch(file.name))


def is_running(journal: Path) -> bool:
    """Whether its process, on this computer and not this one, may write more."""
    import psutil

    host, process = _writer(journal)
    living = process < _PROCESSES and psutil.pid_exists(process)
    return host == os.uname().nodename and process != os.getpid() and living


def is_closed(journal: Path) -> bool:
    """Whether its process is gone: known here, taken for granted elsewhere after a day."""
    if _writer(journal)[0] == os.uname().nodename:
        return not is_running(journal)
    return time.time() - journal.stat().st_mtime > _DAY_S


def _writer(journal: Path) -> tuple[str, int]:
    """Host and process."""
    name = _NAME.fullmatch(journal.name)
    assert name is not None
    return name["host"], int(name["process"])


def sha256_of(path: Path) -> str:
    """Hash of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_of_files(contents: Iterable[str]) -> str:
    """Letters that change with the contents of some files, given their hashes."""
    return hashlib.sha256("\n".join(contents).encode()).hexdigest()[:16]
