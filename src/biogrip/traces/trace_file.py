"""Check of the path of a recorded trace."""

from pathlib import Path

from biogrip.errors import nearest
from biogrip.terminal import visible

_SHOWN = 200


def trace_file_problem(path: str | Path) -> str | None:
    """Return what is wrong with the path of a trace, or None if it is a file."""
    file = Path(path)
    shown = visible(path)
    shown = shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
    found = f"found '{shown}', allowed is a file that exists."
    try:
        if file.is_file():
            return None
        if file.is_dir():
            return f"found the folder '{shown}', allowed is a file."
        if file.exists():
            return f"found '{shown}', which is no regular file; allowed is one."
        beside = [str(other) for other in file.parent.glob("*") if other.is_file()]
    except (OSError, ValueError):
        # A name that is too long or invalid for the system: no neighbours to suggest.
        return found
    return found + nearest(str(file), beside)
