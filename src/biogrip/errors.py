"""The exception for errors that users can correct."""

from collections.abc import Iterable
from difflib import get_close_matches


class BiogripError(Exception):
    """Error that the user can correct; its message says what was found and what is allowed."""


def nearest(name: object, allowed: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` for the allowed name closest to `name`, else ``""``."""
    by_lower = {choice.lower(): choice for choice in allowed}
    close = get_close_matches(str(name).lower(), list(by_lower), n=1, cutoff=0.4)
    return f" Did you mean '{by_lower[close[0]]}'?" if close else ""


def nearest_three(name: object, allowed: Iterable[str]) -> str:
    """Return the three allowed names closest to `name`, for a message."""
    close = get_close_matches(str(name).lower(), [*dict.fromkeys(allowed)], n=3, cutoff=0.0)
    return " or ".join(f"'{choice}'" for choice in close)
