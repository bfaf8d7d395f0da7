"""Reader of JSON results that checks for required keys."""

import json
from collections.abc import Set
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError


def read_object(path: Path, kind: str, keys: Set[str], lacking: str) -> dict[str, Any]:
    """Read a JSON object of some kind, with a message if one of the required keys is lacking."""
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as {kind}: {error}.") from error
    if not keys <= set(found):
        raise BiogripError(f"{path}: {lacking}.")
    return found
