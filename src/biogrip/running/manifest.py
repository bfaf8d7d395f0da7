"""The record of every file that a study wrote: what is whole, and what is the study's own.

A run merges what its jobs noted in their journals into ``manifest.jsonl``, of
which a second copy lies beside the journals.
"""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import scratch_of
from biogrip.running.journal import JOURNALS, Record, sha256_of

NAME = "manifest.jsonl"
"""Name of the manifest, in the results and beside the journals."""

# A file may be found as it was before a write that was killed in its last instant.
_KEPT = 2
_DAY_S = 86_400.0


class Manifest:
    """The records of a results folder.

    Parameters
    ----------
    results
        The folder; it need not exist.

    Raises
    ------
    BiogripError
        If a file that is none of ours is in the manifest's place.
    """

    def __init__(self, results: Path) -> None:
        self._results = results
        self._records: dict[str, list[Record]] = {}
        journals = sorted((results / JOURNALS).glob("*--*.jsonl"))
        # Before they are read: what is added to one later must not go with it.
        self._closed = [journal for journal in journals if _is_closed(journal)]
        copies = [results / NAME, results / JOURNALS / NAME]
        readings = [_read(copy) for copy in copies]
        self._damaged = [c for c, r in zip(copies, readings, strict=True) if r is None]
        intact = [reading for reading in readings if reading]
        if not intact and copies[0] in self._damaged and not journals:
            raise BiogripError(
                f"{copies[0]}: is no record that biogrip wrote, and in the place of one. "
                "Move it away and run again."
            )
        for reading in intact:
            self._add(reading)
        for journal in journals:
            self._add(_lines(journal.read_text(encoding="utf-8", errors="replace")))

    def _add(self, records: Iterable[Record]) -> None:
        for record in records:
            known = self._records.setdefault(record.path, [])
            if record not in known:
                known.append(record)
                known.sort(key=lambda r: r.recorded_ns)
                del known[:-_KEPT]

    @property
    def paths(self) -> list[str]:
        """Everything that is recorded, sorted, as in `Record`."""
        return sorted(self._records)

    @property
    def files(self) -> list[str]:
        """What is recorded with its contents: all but the logs."""
        return [path for path in self.paths if self._records[path][-1].sha256]

    def knows(self, path: str) -> bool:
        """Whether the study wrote a file of this path."""
        return path in self._records

    def last(self, path: str) -> Record:
        """Return how a file of this path, one of `paths`, was written last."""
        return self._records[path][-1]

    def is_whole(self, path: str, *, thoroughly: bool = False) -> bool:
        """Whether a file is what was written last.

        Parameters
        ----------
        path
            One of `files`, which is there.
        thoroughly
            Whether to read it even if size and time are the recorded ones.
        """
        return self._is(path, self._records[path][-1], thoroughly=thoroughly)

    def was_written(self, path: str) -> bool:
        """Whether a file is what was written last or before."""
        return any(self._is(path, record, thoroughly=True) for record in self._records[path])

    def _is(self, path: str, record: Record, *, thoroughly: bool) -> bool:
        file = self._results / path
        stat = file.stat(follow_symlinks=False)
        if stat.st_size != record.size or file.is_symlink():
            return False
        if stat.st_mtime_ns == record.modified_ns and not thoroughly:
            return True
        return sha256_of(file) == record.sha256

    def forget(self, paths: Iterable[str]) -> None:
        """Leave out what is not there any more."""
        for path in paths:
            del self._records[path]

    def save(self) -> None:
        """Write both copies, and remove the journals that nobody adds to any more."""
        for copy in self._damaged:
            set_aside(copy)
        self._damaged = []
        lines = [json.dumps(asdict(r)) for path in self.paths for r in self._records[path]]
        text = "".join(f"{line}\n" for line in lines)
        text += json.dumps({"sha256_of_the_lines_above": _digest(text)}) + "\n"
        for copy in (self._results / NAME, self._results / JOURNALS / NAME):
            copy.parent.mkdir(parents=True, exist_ok=True)
            scratch = scratch_of(copy)
            scratch.write_text(text, encoding="utf-8", newline="\n")
            os.replace(scratch, copy)
        for journal in self._closed:
            journal.unlink(missing_ok=True)


def verify(results: Path) -> str:
    """Read every recorded file of a results folder, and hold it against its record.

    Returns
    -------
    str
        How many there are.

    Raises
    ------
    BiogripError
        Names every file that is missing or is not what was written.
    """
    manifest = Manifest(results)
    if not manifest.files:
        raise BiogripError(f"{results}: holds no record of a study.")
    problems = []
    for path in manifest.files:
        if not os.path.lexists(results / path):
            problems.append(f"{results / path}: is missing.")
        elif not manifest.is_whole(path, thoroughly=True):
            problems.append(f"{results / path}: is not what was written (edited, or damaged).")
    if problems:
        raise BiogripError("\n".join([*problems, "The next run makes them again."]))
    return f"{len(manifest.files)} files of {results} are what was written."


def clean(results: Path) -> str:
    """Remove what a study wrote, and nothing else; folders that are then empty go, too.

    Returns
    -------
    str
        What was done, and what was left.
    """
    manifest = Manifest(results)
    removed, left = 0, []
    for path in manifest.paths:
        file = results / path
        if file.is_symlink() or not file.is_file():
            continue
        if path in manifest.files and not manifest.was_written(path):
            left.append(str(file))
        else:
            file.unlink()
            removed += 1
    own = [results / JOURNALS, results / NAME]
    for file in [*(results / JOURNALS).glob("*.jsonl"), *own[1:]]:
        file.unlink(missing_ok=True)
    folders = {parent for path in manifest.paths for parent in (results / path).parents}
    for folder in sorted({*folders, own[0]}, key=lambda f: len(f.parts), reverse=True):
        if folder.is_dir() and results in (folder, *folder.parents) and not any(folder.iterdir()):
            folder.rmdir()
    kept = f" Kept, for they were edited: {', '.join(left)}." if left else ""
    return f"{removed} files of {results} removed.{kept}"


def set_aside(path: Path) -> Path:
    """Rename a file to ``NAME.edited``, or ``NAME.edited.2`` and so on, and return where it is."""
    count = 1
    while True:
        beside = path.with_name(f"{path.name}.edited" + (f".{count}" if count > 1 else ""))
        if not os.path.lexists(beside):
            path.rename(beside)
            return beside
        count += 1


def _read(path: Path) -> list[Record] | None:
    """Read one copy of the manifest: nothing if there is none, None if it is damaged."""
    if not os.path.lexists(path):
        return []
    try:
        text = path.read_text(encoding="utf-8")
        *above, last = text.splitlines(keepends=True)
        intact = json.loads(last)["sha256_of_the_lines_above"] == _digest("".join(above))
        return [Record(**json.loads(line)) for line in above] if intact else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _lines(text: str) -> Iterator[Record]:
    """Records of a journal, whose last line a kill may have cut."""
    for line in text.splitlines():
        try:
            yield Record(**json.loads(line))
        except (ValueError, TypeError):
            continue


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _is_closed(journal: Path) -> bool:
    """Whether its process is gone: known here, taken for granted elsewhere after a day."""
    host, pid, _ = journal.stem.rsplit("--", 2)
    if host == os.uname().nodename and pid.isdigit():
        import psutil

        return not psutil.pid_exists(int(pid)) or int(pid) == os.getpid()
    return time.time() - journal.stat().st_mtime > _DAY_S
