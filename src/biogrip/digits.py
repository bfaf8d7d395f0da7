"""How many digits of a number are written."""

# Far more than is determined, far fewer than those in which processors differ.
_DIGITS = 5


def rounded(value: float | None) -> float | None:
    """Return a number to five significant digits."""
    return None if value is None else float(f"{value:.{_DIGITS}g}")
