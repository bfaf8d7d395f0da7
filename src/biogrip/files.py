"""Atomic writing of files, and digests of what is in files."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

from biogrip import __version__
from biogrip.errors import BiogripError
from biogrip.processes import unfinished
from biogrip.terminal import visible


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a scratch path beside `path`, and move it into place if no error occurs.

    After a loss of power there is the old file or the new one, whole.

    If the file cannot be written, it is a `BiogripError`.
    """
    scratch = scratch_path(path)
    unfinished.add(str(scratch))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for left in left_in(path.parent, ".*.[0-9]*.part"):
            # What has another name may be another machine's, which goes on.
            if left.name.startswith(f".{path.name}."):
                left.unlink(missing_ok=True)
        # A link that somebody has put there is not followed.
        scratch.unlink(missing_ok=True)
        scratch.touch(exist_ok=False)
        yield scratch
        _to_disk(scratch)
        os.replace(scratch, path)
        # Not every system of files does this for a folder.
        with suppress(OSError):
            _to_disk(path.parent)
    except OSError as error:
        raise BiogripError(
            f"{visible(path)}: cannot be written: {error.strerror or error}."
        ) from error
    finally:
        # The error is reported already.
        with suppress(OSError):
            scratch.unlink(missing_ok=True)
        unfinished.discard(str(scratch))


def _to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    opened = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def scratch_path(path: Path) -> Path:
    """Return the scratch path of a file, unique to this process."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


@cache
def left_in(folder: Path, pattern: str) -> list[Path]:
    """Return what killed processes have left, whose number stands before the last dot."""
    every = folder.glob(pattern) if os.path.exists("/proc/self") else ()
    return [it for it in every if not os.path.exists(f"/proc/{it.name.split('.')[-2]}")]


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with atomic_write(path) as scratch:
        scratch.write_text(text, encoding="utf-8", newline="\n")


def digest_of(file: Path) -> str:
    """Return a digest of what is in a file; nothing if it is not there."""
    if not file.is_file():
        return ""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()[:12]


@cache
def software(*others: Path) -> dict[str, str]:
    """Return versions of what computes results, and a digest of the source in our folders."""
    source = "".join(
        f"{file.relative_to(folder)} {digest_of(file)}\n"
        for folder in (Path(__file__).parent, *others)
        for file in sorted(folder.rglob("*"))
        if file.suffix in (".py", ".yaml", ".j2", ".css", ".js")
    )
    digest = hashlib.sha256(source.encode()).hexdigest()[:12]
    versions = {name: version(name) for name in ("numpy", "scipy")}
    return {"biogrip": __version__, **versions, "source": digest}
