"""Results of single traces or cells, which a job keeps for as long as they would be the same."""

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.files import write_text

FOLDER = Path("results/traces")
"""Folder of all results of a sheet's traces."""

_LONGEST_STEM, _LETTERS = 60, 8


def file_of(folder: Path, name: str, identity: str) -> Path:
    """Return the file of the results of a trace or cell, which another never has.

    Parameters
    ----------
    folder
        Folder of the file.
    name
        Name that the file's begins with.
    identity
        Text that no other has.
    """
    stem = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:_LONGEST_STEM]
    own = hashlib.sha256(identity.encode(errors="surrogateescape")).hexdigest()
    return folder / f"{stem}-{own[:_LETTERS]}.json"


def write_results(file: Path, made_for: str, results: Mapping[str, Any]) -> None:
    """Write results, with a digest of what they were made of and one of themselves."""
    content = {"made_for": made_for, **results}
    write_text(file, json.dumps({"seal": _seal(content), **content}, indent=1) + "\n")


def read_results(file: Path, made_for: str | None = None) -> dict[str, Any] | None:
    """Return the results in a file, or None if they are not whole, or made of something else."""
    try:
        found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        whole = found.pop("seal") == _seal(found)
        return found if whole and made_for in (None, found["made_for"]) else None
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def kept_results(file: Path) -> dict[str, Any]:
    """Return the results in a file.

    Raises
    ------
    BiogripError
        If it is not there, or was changed.
    """
    found = read_results(file)
    if found is None:
        raise BiogripError(
            f"{file}: is not there, or is not as it was written. `biogrip run` makes it again."
        )
    return found


def _seal(results: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(results, indent=1).encode()).hexdigest()
