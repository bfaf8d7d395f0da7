"""How numbers and their units are written."""

# Far more than is determined, far fewer than those in which processors differ.
_DIGITS = 5


def rounded(value: float | None) -> float | None:
    """Return a number to five significant digits."""
    return None if value is None else float(f"{value:.{_DIGITS}g}")


def with_unit(name: str, unit: str) -> str:
    """Return a quantity's name with its unit behind it, if it has one: ``k (N/m)``, ``alpha``."""
    return f"{name} ({unit})" if unit else name
