"""What is said of a case, as JSON, read with its keys checked."""

import json
from collections.abc import Set
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError


def read_object(path: Path, kind: str, keys: Set[str], lacking: str) -> dict[str, Any]:
    """Read a JSON object.

    Parameters
    ----------
    path
        The file.
    kind
        What it should be, in words.
    keys
        Those that it must have.
    lacking
        What is said of one without them.

    Raises
    ------
    BiogripError
        If it is missing or is not one.
    """
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as {kind}: {error}.") from error
    if not keys <= set(found):
        raise BiogripError(f"{path}: {lacking}.")
    return found
