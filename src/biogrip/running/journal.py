"""Journal of the files that one process writes into the results.

A file is recorded before it is moved into place, so that after a kill no file lacks its record.
Each process has its own journal with a line per file, so that no file system needs locks.
"""

import hashlib
import os
import re
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from biogrip.files import watch_writes
from biogrip.running.records import Record

JOURNALS = ".manifest"
"""Folder of the journals, inside the results folder."""

_NAME = re.compile(r"(?P<host>.+)--(?P<process>\d+)--(?P<begun>\d+)\.jsonl")
_DAY_S = 86_400.0
_PROCESSES = 2**31
# Clocks of processes and of files may differ by so much.
_CLOCK_S = 2.0


class Journal:
    """Journal of the files that one process writes into a results folder.

    Parameters
    ----------
    results
        The results folder.
    settings, inputs
        Digests for all its files, see `biogrip.running.records.Record`.
    """

    def __init__(self, results: Path, settings: str = "", inputs: str = "") -> None:
        self._results = results.absolute()
        name = f"{os.uname().nodename}--{os.getpid()}--{time.time_ns()}.jsonl"
        self._file = self._results / JOURNALS / name
        self._made = settings, inputs

    def note(self, path: Path, content: Path) -> None:
        """Record that `path` is about to have the present content of `content`.

        Paths outside the results folder are not recorded.
        """
        if path.absolute().is_relative_to(self._results):
            self._append(self.record(path, content))

    def record(self, path: Path, content: Path) -> Record:
        """Return a record of `path`, among the results, with the present content of `content`."""
        stat = content.stat()
        return Record(
            path.absolute().relative_to(self._results).as_posix(),
            stat.st_size,
            hash_file(content),
            stat.st_mtime_ns,
            time.time_ns(),
            *self._made,
        )

    def note_begun(self, paths: Iterable[Path]) -> None:
        """Record that logs or scratch files are about to be written."""
        self._append(None)
        for path in paths:
            whole = path.absolute()
            if whole.is_relative_to(self._results):
                name = whole.relative_to(self._results).as_posix()
                self._append(Record(name, 0, "", 0, time.time_ns()))

    def _append(self, record: Record | None) -> None:
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a", encoding="utf-8") as stream:
            stream.write(record.line if record else "")


@contextmanager
def recorded_in(results: Path, settings: str = "", inputs: str = "") -> Iterator[None]:
    """Record every file written atomically below a results folder within a context."""
    journal = Journal(results, settings, inputs)
    # While it is there, results are being written.
    journal.note_begun([])
    with watch_writes(journal.note, lambda scratch: journal.note_begun([scratch])):
        yield


def journals_in(results: Path) -> list[Path]:
    """Return the journals of a results folder; files with other names are ignored."""
    return sorted(file for file in (results / JOURNALS).glob("*") if _NAME.fullmatch(file.name))


def is_running(journal: Path) -> bool:
    """Return True if another process on this host may still write to the journal."""
    host, process, begun_ns = _writer(journal)
    return host == os.uname().nodename and process != os.getpid() and lives(process, begun_ns)


def lives(process: int, begun_ns: int) -> bool:
    """Return True if the process that had a number on this host at a time still has it."""
    import psutil

    with suppress(psutil.Error):
        # A later process may have got the same number.
        return process < _PROCESSES and (
            psutil.Process(process).create_time() <= begun_ns / 1e9 + _CLOCK_S
        )
    return False


def is_gone(process: str) -> bool:
    """Return True if no process on this host has a number."""
    import psutil

    return process.isdigit() and int(process) < _PROCESSES and not psutil.pid_exists(int(process))


def is_closed(journal: Path) -> bool:
    """Return True if the journal's process has ended; on other computers assumed after a day."""
    if _writer(journal)[0] == os.uname().nodename:
        return not is_running(journal)
    return time.time() - journal.stat().st_mtime > _DAY_S


def _writer(journal: Path) -> tuple[str, int, int]:
    """Return host and process id of a journal."""
    name = _NAME.fullmatch(journal.name)
    assert name is not None
    return name["host"], int(name["process"]), int(name["begun"])


def hash_file(path: Path) -> str:
    """Return the SHA-256 hash of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_of_files(contents: Iterable[str]) -> str:
    """Return a digest of several files, given their hashes."""
    return hashlib.sha256("\n".join(contents).encode()).hexdigest()[:16]
