"""Formatting and rounding of numbers, with units."""

import math
import re
from typing import Any

import numpy as np

from biogrip.arrays import Array

# More digits than data determine, and fewer than those in which processors differ.
_ROUNDED_DIGITS = 5
_MOST_ROUNDED_DIGITS = 9
# Fits are converged to 0.001 in chi^2; smaller digits may differ between processors.
_INCREASE_DECIMALS = 2

# Parsed by Python: powers computed by different processors may differ.
_LARGEST = 300
_TENS = np.array([float(f"1e{exponent}") for exponent in range(-_LARGEST, _LARGEST + 1)])


def rounded(value: float | None) -> float | None:
    """Round to five significant digits, or more if later rounding to fewer would change.

    For example, 1.16499 is 1.16 to three digits, but 1.165 is 1.17. What is rounded stays if it is
    rounded again.
    """
    if value is None:
        return None
    for digits in range(_ROUNDED_DIGITS, _MOST_ROUNDED_DIGITS):
        shorter = float(f"{value:.{digits}g}")
        if all(f"{shorter:.{few}g}" == f"{value:.{few}g}" for few in range(2, _ROUNDED_DIGITS)):
            return shorter if shorter == value or digits == _ROUNDED_DIGITS else rounded(shorter)
    return float(f"{value:.{_ROUNDED_DIGITS}g}")


def rounded_numbers(data: Any) -> Any:
    """Round all numbers in plain data (lists and dictionaries) to five significant digits."""
    if isinstance(data, dict):
        return {key: rounded_numbers(value) for key, value in data.items()}
    if isinstance(data, list):
        return [rounded_numbers(value) for value in data]
    return rounded(data) if isinstance(data, float) else data


def round_increase(increase: float) -> float:
    """Round an increase of chi^2 to five digits, and to the tolerance of fits."""
    return float(f"{round(increase, _INCREASE_DECIMALS):.{_ROUNDED_DIGITS}g}") + 0.0


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


# Ends of the numbers that a person reads as plain decimals, and ratio of limits far apart.
_SMALLEST_PLAIN, _LARGEST_PLAIN, _FAR_APART = 1e-4, 1e6, 10.0
# Most digits of numbers with limits: those of a trace without noise coincide.
_MOST_DIGITS_WITH_LIMITS = 7


def plain(value: float, digits: int = 3) -> str:
    """Return a number with significant digits as a person reads it: 1500, not 1.5e+03."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < _LARGEST_PLAIN else text


def within_limits(value: float, low: float, high: float, *others: float) -> list[str]:
    """Return numbers with as many digits as the width of the limits leaves sense to.

    Their last digit is at most a quarter of the width, and at most the third digit of the upper
    limit: 0.000200, 0.000196 and 0.000204. Limits further apart than a factor of ten leave two
    digits of each, and three of the others.
    """
    numbers = (value, low, high, *others)
    if not 0 < low <= high <= _FAR_APART * low:
        return [*(plain(number, 2) for number in numbers[:3]), *map(plain, others)]
    last = min(_power(high) - 2, _power((high - low) / 4) if high > low else -_LARGEST)
    last = max(last, _power(high) + 1 - _MOST_DIGITS_WITH_LIMITS)
    if _SMALLEST_PLAIN <= value < _LARGEST_PLAIN:
        return [f"{round(number, -last):.{max(-last, 0)}f}" for number in numbers]
    return [f"{number:.{max(_power(number) - last, 0)}e}" for number in numbers]


def with_limits(value: float, low: float, high: float, unit: str = "") -> str:
    """Return a number and its limits, `within_limits`: ``1504 Pa (1489 to 1519)``."""
    number, *ends = within_limits(value, low, high)
    return f"{number} {unit}".rstrip() + f" ({' to '.join(ends)})"


def instant(time_s: float, low_s: float, high_s: float) -> str:
    """Return a time of any clock and its limits, with two digits of how far the nearer one is."""
    sides = [side_s for side_s in (time_s - low_s, high_s - time_s) if side_s > 0]
    decimals = max(1 - _power(2 * min(sides)), 0) if sides else _MOST_DIGITS_WITH_LIMITS
    time, low, high = (f"{time:z.{decimals}f}" for time in (time_s, low_s, high_s))
    return f"{time} s ({low} to {high})"


def _power(value: float) -> int:
    return math.floor(math.log10(value))


def counted(count: object, noun: str) -> str:
    """Return a count with a regular noun: ``1 row``, ``3 rows``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"


def with_unit(name: str, unit: str) -> str:
    """Return a name followed by its unit, if it has one: ``k (N/m)``, ``alpha``."""
    return f"{name} ({unit})" if unit else name


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_E_NOTATION = re.compile(r"(\d[\d.]*)e([+-]\d+)\b")
_MINUS = re.compile(r"(?<![\w.⁻-])-(?=\d)")
_BEFORE_UNIT = re.compile(
    r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=%|[kmµn]?(?:N|m|s|rad|Pa|Hz|V)\b)|(?<=N|a) (?=[sm]\b)"
)


def legible(text: str) -> str:
    """Return text for print: 1.1e-05 as 1.1·10⁻⁵, 3.4e+03 as 3400, units on their numbers' line."""

    def power(match: re.Match[str]) -> str:
        number, tens = plain(float(match[0]), 4), f"{int(match[2])}".translate(SUPERSCRIPTS)
        return f"{match[1]}·10{tens}" if "e" in number else number

    return _BEFORE_UNIT.sub("\u00a0", _MINUS.sub("−", _E_NOTATION.sub(power, text)))


def p_value(chance: float) -> str:
    """Return the chance of as much in what is right; smaller ones are not told apart."""
    return "p < 1e-6" if chance < 1e-6 else f"p = {plain(chance, 1)}"
