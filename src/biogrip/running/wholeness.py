"""What a run does before its jobs: see what is whole, and touch nothing but what is the study's."""

import functools
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from biogrip.errors import BiogripError
from biogrip.running.journal import Journal
from biogrip.running.locks import release_dead_locks
from biogrip.running.manifest import Manifest, set_aside

_SHOWN = 6
_ROOM_BYTES = 256 * 1024


def held_against_record(
    execute: Callable[..., Any],
    results: Path,
    asked: Callable[[], Iterable[str]],
    may_make: Callable[[str], bool],
    begin: Callable[[], None],
) -> Callable[..., Any]:
    """Wrap what Snakemake calls once it is to run a study, and before it plans the jobs.

    Of all commands only a run changes anything; a dry run says what a run would do.

    Parameters
    ----------
    execute
        ``workflow.execute``.
    results
        The results folder.
    asked
        Tells which files a run makes if nothing else is asked for.
    may_make
        Whether a rule of the study makes a file.
    begin
        What a run does then, before its jobs are planned.
    """

    @functools.wraps(execute)
    def checked(*args: Any, **kwargs: Any) -> Any:
        kind = kwargs["executor_plugin"].common_settings
        if not kind.touch_exec:
            try:
                check_results(results, asked(), may_make, changing=not kind.dryrun_exec)
                if not kind.dryrun_exec:
                    release_dead_locks(Path(".snakemake"))
                    begin()
            except BiogripError as error:
                sys.exit(f"biogrip: {error}")
        return execute(*args, **kwargs)

    return checked


def check_results(
    results: Path, asked: Iterable[str], may_make: Callable[[str], bool], *, changing: bool
) -> None:
    """Hold the results against their record, so that what is not whole is made again.

    A recorded file with other contents is kept beside as ``NAME.edited``, for
    nobody can tell damage from an edit; an empty one is removed. What this study
    would not make again stays as it is.

    Parameters
    ----------
    results, may_make
        As of `held_against_record`.
    asked
        Files that a run makes if nothing else is asked for.
    changing
        Whether to do it, or only say what would be done.

    Raises
    ------
    BiogripError
        If a file is in the way that the study did not write, or is a link; or if
        the folder cannot be written to.
    """
    wanted = [Path(file) for file in asked]
    refuse_links(results, wanted)
    if changing:
        _check_writable(results)
    manifest = Manifest(results)
    refuse_others(manifest, results, wanted)
    gone = []
    for path in manifest.files:
        file = results / path
        if not os.path.lexists(file):
            gone.append(path)
        elif not manifest.is_whole(path) and may_make(str(file)):
            refuse_links(results, [file])
            make_room(manifest, results, path, changing=changing)
            gone.append(path)
    if changing and manifest.paths:
        manifest.forget(gone)
        manifest.save()


def claim(results: Path, files: Iterable[Path], logs: Iterable[Path]) -> None:
    """Make sure, before jobs run, that what they write is the study's or not there.

    Parameters
    ----------
    results
        The results folder.
    files, logs
        What the jobs will write.

    Raises
    ------
    BiogripError
        If a file is in the way that the study did not write, or is a link.
    """
    manifest, files, logs = Manifest(results), list(files), list(logs)
    refuse_links(results, [*files, *logs])
    refuse_others(manifest, results, [*files, *logs])
    Journal(results).note_logs(log for log in logs if not manifest.knows(_name(results, log)))


def refuse_others(manifest: Manifest, results: Path, files: Iterable[Path]) -> None:
    """Refuse to go on where files are that are to be written, and that the study did not write.

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


def refuse_links(results: Path, files: Iterable[Path]) -> None:
    """Refuse to go on where writing files would follow a link, from the results folder on.

    Raises
    ------
    BiogripError
        Names the first link.
    """
    seen = {results}
    for file in files:
        seen.update((file, *file.parents))
    for place in sorted(seen):
        if place.is_symlink() and (place == results or results in place.parents):
            raise BiogripError(
                f"{place}: is a link, and nothing is written through links. Put a folder or "
                "nothing in its place; a study elsewhere is run with --directory."
            )


def _check_writable(results: Path) -> None:
    """Make the results folder, and see that it and what is in it can be written to."""
    folders = [results]
    try:
        results.mkdir(parents=True, exist_ok=True)
        folders += [p for p in results.iterdir() if p.is_dir() and not p.is_symlink()]
    except OSError:
        pass
    for place in folders:
        try:
            # Jobs of a cluster try this at once: a name of its own for each, or none.
            with TemporaryFile(dir=place) as probe:
                # Room for Snakemake's own notes too: it fails half-way through writing its locks.
                probe.write(bytes(_ROOM_BYTES if place == results else 0))
        except OSError as error:
            raise BiogripError(
                f"{place}: results cannot be written here: {error.strerror}. Allowed is a folder "
                "that you may write to, on a disk with space."
            ) from error


def make_room(manifest: Manifest, results: Path, path: str, *, changing: bool) -> None:
    """Clear the place of a recorded file that is not what was written, and say how.

    Parameters
    ----------
    manifest, results
        The record, and where the files are.
    path
        The file, from the results folder on.
    changing
        Whether to do it, or only say what would be done.
    """
    file = results / path
    if file.stat().st_size == 0 or manifest.was_written(path):
        how = "was emptied" if file.stat().st_size == 0 else "is of an earlier run"
        if changing:
            file.unlink()
    else:
        kept = set_aside(file) if changing else f"{file}.edited"
        how = f"is not what was written (edited, or damaged), kept as {kept}"
    then = "making it again" if changing else "a run makes it again"
    print(f"biogrip: {file}: {how}; {then}.", file=sys.stderr)


def _name(results: Path, file: Path) -> str:
    return Path(os.path.relpath(file, results)).as_posix()
