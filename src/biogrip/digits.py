"""Formatting and rounding of numbers, with units."""

from typing import Any

import numpy as np

from biogrip.arrays import Array

# More digits than data determine, and fewer than those in which processors differ.
_DIGITS = 5
_MOST_DIGITS = 9
# Fits are converged to 0.001 in chi^2; smaller digits may differ between processors.
_INCREASE_DECIMALS = 2

# Parsed by Python: powers computed by different processors may differ.
_LARGEST = 300
_TENS = np.array([float(f"1e{exponent}") for exponent in range(-_LARGEST, _LARGEST + 1)])


def rounded(value: float | None) -> float | None:
    """Round to five significant digits, or more if later rounding to fewer would change.

    For example, 1.16499 is 1.16 to three digits, but 1.165 is 1.17.
    """
    if value is None:
        return None
    for digits in range(_DIGITS, _MOST_DIGITS):
        found = float(f"{value:.{digits}g}")
        if all(f"{found:.{few}g}" == f"{value:.{few}g}" for few in range(2, _DIGITS)):
            return found
    return float(f"{value:.{_DIGITS}g}")


def rounded_numbers(data: Any) -> Any:
    """Round all numbers in plain data (lists and dictionaries) to five significant digits."""
    if isinstance(data, dict):
        return {key: rounded_numbers(value) for key, value in data.items()}
    if isinstance(data, list):
        return [rounded_numbers(value) for value in data]
    return rounded(data) if isinstance(data, float) else data


def round_increase(increase: float) -> float:
    """Round an increase of chi^2 to five digits, and to the tolerance of fits."""
    return float(f"{round(increase, _INCREASE_DECIMALS):.{_DIGITS}g}") + 0.0


def significant(values: Array, digits: int) -> Array:
    """Round numbers to significant digits, with the same bits on every processor."""
    values = np.array(values, dtype=float)
    sizes = np.abs(values)
    usual = (sizes > _TENS[2 * digits]) & (sizes < _TENS[-2 * digits])
    shift = digits + _LARGEST - _TENS.searchsorted(sizes[usual], side="right")
    # Multiply and divide by exact powers of ten only, so that decimals are the nearest floats.
    up, down = np.maximum(shift, 0) + _LARGEST, np.maximum(-shift, 0) + _LARGEST
    values[usual] = np.rint(values[usual] / _TENS[down] * _TENS[up]) / _TENS[up] * _TENS[down]
    return values


def counted(count: object, noun: str) -> str:
    """Return a count with a regular noun: ``1 row``, ``3 rows``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"


def with_unit(name: str, unit: str) -> str:
    """Return a name followed by its unit, if it has one: ``k (N/m)``, ``alpha``."""
    return f"{name} ({unit})" if unit else name
