"""Checks before and after the jobs of a run, so that only the study's own files are touched."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from biogrip.errors import BiogripError
from biogrip.running.journal import Journal
from biogrip.running.manifest import STUDY, Manifest, set_aside
from biogrip.running.places import refuse_files_as_folders, refuse_links
from biogrip.terminal import visible, visible_lines

_SHOWN = 6
_ROOM_BYTES = 256 * 1024


@contextmanager
def message_only() -> Iterator[None]:
    """Exit with an error's message only, without a traceback from Snakemake."""
    try:
        yield
    except BiogripError as error:
        sys.exit(f"biogrip: {visible_lines(error)}")


def say_what_else_is_there(results: Path, requested: Iterable[str]) -> None:
    """Print how many results belong to other studies."""
    own = [_name(results, Path(file)) for file in requested]
    others = Manifest(results).others([*own, STUDY])
    if others:
        print(
            f"biogrip: {results} also holds results of other studies ({len(others)}, the first "
            f"{visible(others[0])}). To keep studies apart: --directory FOLDER.",
            file=sys.stderr,
        )


def check_results(
    results: Path, requested: Iterable[str], may_make: Callable[[str], bool], *, changing: bool
) -> None:
    """Compare the results with their record, and remove files that must be made again.

    A changed file is renamed to ``NAME.edited``, since damage and edits look the same; an empty
    one is removed. Files that this study does not make are kept.

    Parameters
    ----------
    results
        The results folder.
    requested
        Files that a run makes by default.
    may_make
        Function that returns True if a rule of the study makes a file.
    changing
        If false, only print what would be done.

    Raises
    ------
    BiogripError
        If a file is in the way that the study did not write, a path has a link, or the folder is
        not writable.
    """
    files = [Path(file) for file in requested]
    refuse_links(results, files)
    refuse_files_as_folders(results, files)
    if changing:
        _check_writable(results, files)
    manifest = Manifest(results)
    refuse_others(manifest, results, files)
    gone = []
    for path in manifest.files:
        file = results / path
        if not os.path.lexists(file):
            gone.append(path)
        elif manifest.is_whole(path):
            if changing:
                manifest.restore_time(path)
        elif may_make(str(file)):
            refuse_links(results, [file])
            make_room(manifest, results, path, changing=changing)
            gone.append(path)
    if changing:
        manifest.discard_leftovers()
    if changing and manifest.paths:
        manifest.forget(gone)
        manifest.save()


class Claim:
    """Outputs and logs of the jobs in a run.

    Parameters
    ----------
    results
        The results folder.
    """

    def __init__(self, results: Path) -> None:
        self._results = results
        self._files: list[Path] = []
        self._logs: list[Path] = []

    def begin(
        self,
        files: Iterable[Path],
        logs: Iterable[Path],
        reads: Iterable[Path] = (),
        made_otherwise: Callable[[Manifest], Iterable[str]] = lambda _: (),
        *,
        touching: bool = False,
    ) -> None:
        """Check, before jobs run, that their outputs are the study's own or do not exist.

        An output or a log with other contents than were written is renamed.

        Parameters
        ----------
        files, logs
            Files the jobs will write.
        reads
            Files the jobs will read.
        made_otherwise
            Function that returns outdated results, relative to the results folder.
        touching
            True if the jobs only touch their outputs, whatever these hold.

        Raises
        ------
        BiogripError
            If a file is in the way that the study did not write, or is a link; or if a job would
            read a result that is outdated or was changed, and that no job makes again.
        """
        results, self._files, self._logs = self._results, list(files), list(logs)
        manifest, both = Manifest(results), [*self._files, *self._logs]
        refuse_links(results, both)
        refuse_files_as_folders(results, both)
        refuse_others(manifest, results, both)
        if touching:
            return
        _check_writable(results, self._files)
        self._refuse_unfit(manifest, set(reads).difference(self._files), made_otherwise)
        names = [_name(results, file) for file in self._files if file.exists()]
        changed = [name for name in names if not manifest.is_whole(name)]
        names = [_name(results, log) for log in self._logs if log.exists()]
        changed += [name for name in names if not manifest.was_written(name)]
        for name in changed:
            make_room(manifest, results, name, changing=True)
        Journal(results).note_begun(self._logs)

    def _refuse_unfit(
        self,
        manifest: Manifest,
        reads: Iterable[Path],
        made_otherwise: Callable[[Manifest], Iterable[str]],
    ) -> None:
        names = {_name(self._results, file): file for file in sorted(reads) if file.exists()}
        names = {name: file for name, file in names.items() if manifest.knows(name)}
        outdated = set(made_otherwise(manifest)) if names else set()
        for name, file in names.items():
            found = "" if manifest.is_whole(name) else "is not what was written"
            if found or name in outdated:
                found = found or "was made for other settings, by other code or of other files"
                raise BiogripError(f"{file}: {found}, and would be read. `biogrip run` mends that.")

    def end(self) -> None:
        """Record what the jobs have written, including logs."""
        manifest = Manifest(self._results)
        manifest.note(self._logs)
        manifest.note_times(_name(self._results, file) for file in self._files)
        manifest.save()


def refuse_others(manifest: Manifest, results: Path, files: Iterable[Path]) -> None:
    """Refuse existing files that are to be written but were not written by the study.

    Raises
    ------
    BiogripError
        Names the first few.
    """
    others = [
        file
        for file in files
        if os.path.lexists(file) and (file.is_dir() or not manifest.knows(_name(results, file)))
    ]
    if others:
        shown = ", ".join(map(str, others[:_SHOWN]))
        more = f" and {len(others) - _SHOWN} more" if len(others) > _SHOWN else ""
        raise BiogripError(
            f"{shown}{more}: in the way, and not written by this study (there is no record of it "
            f"in {results}). Nothing is replaced that is not its own: move it away and run again."
        )


def _check_writable(results: Path, files: Iterable[Path]) -> None:
    """Create the results folder, and check that it and what files are written to are writable."""
    with suppress(OSError):
        results.mkdir(parents=True, exist_ok=True)
    folders = {file.parent for file in files}
    for place in [results, *sorted(folder for folder in folders if folder.is_dir())]:
        try:
            # Jobs of a cluster may do this concurrently, so use unique temporary names.
            with TemporaryFile(dir=place) as probe:
                # Reserve room for Snakemake's notes too: a full disk would leave broken locks.
                probe.write(bytes(_ROOM_BYTES if place == results else 0))
        except OSError as error:
            raise BiogripError(
                f"{place}: results cannot be written here: {error.strerror}. Allowed is a folder "
                "that you may write to, on a disk with space."
            ) from error


def make_room(manifest: Manifest, results: Path, path: str, *, changing: bool) -> None:
    """Remove or rename a recorded file that has changed, and print what was done.

    Parameters
    ----------
    manifest, results
        The manifest, and the results folder.
    path
        Path relative to the results folder.
    changing
        If false, only print what would be done.
    """
    file = results / path
    if file.stat().st_size == 0 or manifest.was_written(path):
        how = "was emptied" if file.stat().st_size == 0 else "is of an earlier run"
        if changing:
            file.unlink()
    else:
        kept = set_aside(file) if changing else f"{file}.edited"
        how = f"is not what was written (edited, or damaged), kept as {kept}"
    then = "making it again" if changing else "`biogrip run` makes it again"
    print(f"biogrip: {visible(file)}: {how}; {then}.", file=sys.stderr)


def _name(results: Path, file: Path) -> str:
    return Path(os.path.relpath(file, results)).as_posix()
