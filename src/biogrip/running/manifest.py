"""Manifest of all files that a study wrote, with sizes and hashes.

A run merges the journals of its jobs into ``manifest.jsonl``; a second copy is in the folder of
the journals.
"""

import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import scratch_path
from biogrip.running.journal import (
    JOURNALS,
    Journal,
    hash_file,
    is_closed,
    is_gone,
    is_running,
    journals_in,
)
from biogrip.running.places import refuse_links, refuse_other_than_folder
from biogrip.running.records import (
    Record,
    hash_lines,
    read_journal,
    read_manifest,
)

NAME = "manifest.jsonl"
"""Name of the manifest, in the results folder and in the folder of the journals."""

STUDY = "study.json"
"""Name of the resolved study in the results folder, the one result that no rule makes."""

# Records kept per file: a kill can leave a file in its state before the last write.
_KEPT = 2


class Manifest:
    """Records of all files in a results folder.

    Parameters
    ----------
    results
        The folder; it need not exist.

    Raises
    ------
    BiogripError
        If a foreign file is in the place of a record, or a record names a file outside the
        folder or behind a link.
    """

    def __init__(self, results: Path) -> None:
        self._results = results
        self._records: dict[str, list[Record]] = {}
        if not results.is_symlink():
            refuse_other_than_folder(results)
        refuse_other_than_folder(results / JOURNALS)
        journals = journals_in(results)
        # Find closed journals before reading them: one that closes later may have unread lines.
        self._closed = [journal for journal in journals if is_closed(journal)]
        self._copies = results / NAME, results / JOURNALS / NAME
        readings = [read_manifest(copy) for copy in self._copies]
        self._damaged = [c for c, r in zip(self._copies, readings, strict=True) if r is None]
        intact = [reading for reading in readings if reading]
        if not intact and self._copies[0] in self._damaged and not journals:
            raise BiogripError(
                f"{self._copies[0]}: is no record that biogrip wrote, and in the place of one. "
                "Move it away and run again."
            )
        for reading in intact:
            self._add(reading)
        scratch = []
        for journal in journals:
            records = read_journal(journal)
            self._add(records)
            if journal in self._closed:
                scratch += [record.path for record in records if record.is_scratch]
        self.is_written_to = any(map(is_running, journals))
        self._leftovers = [results / path for path in scratch]
        above = {(results / path).parent for path in (*self.paths, *scratch)} - {results}
        if not results.is_symlink():
            refuse_links(results, above)

    def _add(self, records: Iterable[Record]) -> None:
        for record in records:
            if record.is_scratch:
                continue
            known = self._records.setdefault(record.path, [])
            if record not in known:
                known.append(record)
                known.sort(key=lambda r: r.recorded_ns)
                del known[:-_KEPT]

    @property
    def paths(self) -> list[str]:
        """Paths of all recorded files, sorted, see `Record`."""
        return sorted(self._records)

    @property
    def files(self) -> list[str]:
        """Paths of all recorded files except logs."""
        return [path for path in self.paths if not self.last(path).is_log]

    def others(self, names: Iterable[str]) -> list[str]:
        """Return recorded files except logs and given names."""
        return sorted({*self.files}.difference(names))

    def knows(self, path: str) -> bool:
        """Return True if the study wrote a file of this path."""
        return path in self._records

    def last(self, path: str) -> Record:
        """Return the last record of a file in `paths`."""
        return self._records[path][-1]

    def is_whole(self, path: str, *, thoroughly: bool = False) -> bool:
        """Return True if a file has the content that was last written.

        Parameters
        ----------
        path
            An existing file of `paths`.
        thoroughly
            If true, check the hash even if size and time agree.
        """
        return self._is(path, self.last(path), thoroughly=thoroughly)

    def note_times(self, paths: Iterable[str]) -> None:
        """Update recorded times of files, since Snakemake touches them after their jobs."""
        for path in paths:
            if self.knows(path) and (self._results / path).is_file() and self.is_whole(path):
                modified_ns = (self._results / path).stat().st_mtime_ns
                self._records[path][-1] = replace(self.last(path), modified_ns=modified_ns)

    def restore_time(self, path: str) -> None:
        """Restore the recorded time of a file, since Snakemake compares times."""
        file, modified_ns = self._results / path, self.last(path).modified_ns
        stat = file.stat()
        if stat.st_mtime_ns != modified_ns:
            with suppress(OSError):
                os.utime(file, ns=(stat.st_atime_ns, modified_ns))

    def was_written(self, path: str) -> bool:
        """Return True if a file has the content of its last write or of the one before."""
        return any(self._is(path, record, thoroughly=True) for record in self._records[path])

    def _is(self, path: str, record: Record, *, thoroughly: bool) -> bool:
        file = self._results / path
        if file.is_symlink() or not file.is_file():
            return False
        stat = file.stat()
        if stat.st_size != record.size:
            return False
        # The record of a log whose job was killed has size 0 and no hash.
        if stat.st_size == 0 or (stat.st_mtime_ns == record.modified_ns and not thoroughly):
            return True
        return hash_file(file) == record.sha256

    def forget(self, paths: Iterable[str]) -> None:
        """Remove files from the records."""
        for path in paths:
            del self._records[path]

    def note(self, logs: Iterable[Path]) -> None:
        """Record logs after their jobs have ended."""
        journal = Journal(self._results)
        self._add(journal.record(log, log) for log in logs if log.is_file())

    def discard_leftovers(self) -> None:
        """Remove scratch files of jobs that were killed."""
        killed = [
            file
            for copy in self._copies
            for file in copy.parent.glob(f".{NAME}.*.part")
            if is_gone(file.name.split(".")[-2])
        ]
        for file in (*self._leftovers, *killed):
            if file.is_file() and not file.is_symlink():
                file.unlink()

    def save(self) -> None:
        """Write both copies, and remove journals whose processes have ended."""
        self.discard_leftovers()
        for copy in self._damaged:
            set_aside(copy)
        self._damaged = []
        text = "".join(record.line for path in self.paths for record in self._records[path])
        text += hash_lines(text.encode())
        for copy in self._copies:
            copy.parent.mkdir(parents=True, exist_ok=True)
            scratch = scratch_path(copy)
            scratch.write_text(text, encoding="utf-8", newline="\n")
            os.replace(scratch, copy)
        self._discard_journals()

    def discard(self) -> None:
        """Remove the manifest and closed journals, except damaged copies."""
        self.discard_leftovers()
        for copy in self._copies:
            if copy not in self._damaged:
                copy.unlink(missing_ok=True)
        self._discard_journals()

    def _discard_journals(self) -> None:
        for journal in self._closed:
            journal.unlink(missing_ok=True)


def set_aside(path: Path) -> Path:
    """Rename a file to ``NAME.edited``, ``NAME.edited.2`` and so on, and return the new path."""
    count = 1
    while True:
        beside = path.with_name(f"{path.name}.edited" + (f".{count}" if count > 1 else ""))
        if not os.path.lexists(beside):
            path.rename(beside)
            return beside
        count += 1
