"""Files written whole or not at all."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.stopping import unfinished
from biogrip.terminal import visible

Watch = Callable[[Path, Path], None]
"""Is told of a file, and of the scratch file with its contents, just before it is in place."""

Begin = Callable[[Path], None]
"""Is told of a scratch file before it is written."""

_watches: list[tuple[Watch, Begin | None]] = []


@contextmanager
def watched(watch: Watch, begin: Begin | None = None) -> Iterator[None]:
    """Have every file told to `watch` that is written whole meanwhile, and before to `begin`."""
    both = watch, begin
    _watches.append(both)
    try:
        yield
    finally:
        _watches.remove(both)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a scratch path beside `path`, and move it into place if all went well.

    Raises
    ------
    BiogripError
        If the file cannot be written.
    """
    scratch = scratch_of(path)
    unfinished.add(str(scratch))
    try:
        for _, begin in _watches:
            if begin is not None:
                begin(scratch)
        path.parent.mkdir(parents=True, exist_ok=True)
        yield scratch
        for watch, _ in _watches:
            watch(path, scratch)
        os.replace(scratch, path)
    except OSError as error:
        raise BiogripError(
            f"{visible(path)}: cannot be written: {error.strerror or error}."
        ) from error
    finally:
        # Why it could not be written is said already.
        with suppress(OSError):
            scratch.unlink(missing_ok=True)
        unfinished.discard(str(scratch))


def scratch_of(path: Path) -> Path:
    """Where this process writes a file before it is whole."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""
    with written_whole(path) as scratch:
        scratch.write_text(text, encoding="utf-8", newline="\n")


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuse to write a file over one that is read, under whatever name.

    Raises
    ------
    BiogripError
        Names the first.
    """
    # Of a path that no system allows, Path.exists raises what it thinks of it.
    read = [path for path in inputs if os.path.exists(path)]
    for output in outputs:
        if os.path.exists(output) and any(output.samefile(path) for path in read):
            raise BiogripError(f"{visible(output)}: is read; allowed is another file to write.")
