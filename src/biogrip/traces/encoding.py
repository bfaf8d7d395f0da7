"""Encodings of text files."""

from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable
from io import StringIO, TextIOWrapper
from pathlib import Path
from typing import TypeVar

from biogrip.errors import BiogripError
from biogrip.traces.columns import place

T = TypeVar("T")

UTF_8 = "UTF-8"
_CODECS = {"UTF-16": "utf-16", UTF_8: "utf-8-sig", "Windows-1252": "cp1252"}


def read_as_text(path: Path, read: Callable[[TextIOWrapper, str], T]) -> T:
    """Return what a function reads from a file in the encoding that it seems to have.

    That is UTF-16 with a byte order mark, UTF-8, or else Windows-1252, as older programs write.

    Parameters
    ----------
    path
        The file.
    read
        Function of the opened file, at its beginning, and the name of its encoding.

    Raises
    ------
    BiogripError
        If the file cannot be read, or not as text.
    """
    try:
        if not path.is_file():
            other = "no regular file" if path.exists() else "no file"
            found = "a directory" if path.is_dir() else other
            raise BiogripError(
                f"{place(path)}: found {found}, allowed is a text file with a trace."
            )
        with path.open("rb") as content:
            marked = content.read(2) in (BOM_UTF16_LE, BOM_UTF16_BE)
        first = "UTF-16" if marked else UTF_8
        try:
            return _read(path, first, read)
        except UnicodeDecodeError:
            if marked:
                raise
        return _read(path, "Windows-1252", read)
    except UnicodeDecodeError as error:
        # Windows-1252 is read last, and Python calls it a charmap.
        codec = "utf-16" if error.encoding.startswith("utf-16") else "cp1252"
        raise BiogripError(_not_text(path, codec)) from error
    except OSError as error:
        raise BiogripError(f"{place(path)}: cannot be read: {error.strerror}.") from error


def _read(path: Path, encoding: str, read: Callable[[TextIOWrapper, str], T]) -> T:
    with path.open(encoding=_CODECS[encoding], newline="") as stream:
        return read(stream, encoding)


def _not_text(path: Path, codec: str) -> str:
    """Return a message with the line of the first byte that is no text."""
    content = path.read_bytes()
    try:
        content.decode(codec)
    except UnicodeDecodeError as error:
        before = StringIO(content[: error.start].decode(codec) + "?", newline="")
        line, byte = sum(1 for _ in before), content[error.start]
        return (
            f"{place(path, line)}: found the byte 0x{byte:02x}, allowed is text in UTF-8, UTF-16 "
            "or Windows-1252."
        )
    return f"{place(path)}: changed while it was read."
