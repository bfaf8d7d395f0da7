"""Files written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from biogrip.errors import BiogripError


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a scratch path beside `path`, and move it into place if all went well.

    Raises
    ------
    BiogripError
        If the file cannot be written.
    """
    scratch = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield scratch
        os.replace(scratch, path)
    except OSError as error:
        raise BiogripError(f"{path}: cannot be written: {error.strerror or error}.") from error
    finally:
        scratch.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file whole."""
    with written_whole(path) as scratch:
        scratch.write_text(text, encoding="utf-8", newline="\n")
