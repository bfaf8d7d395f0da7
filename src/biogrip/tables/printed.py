"""What the paper's printed values and errors leave of the numbers that it printed."""

from collections.abc import Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from itertools import product

from biogrip.study.study import Case

Interval = tuple[float, float]
"""Lowest and highest number."""


def interval_of_value(printed: float) -> Interval:
    """Return the numbers that are printed so, rounded or cut off after the last digit."""
    (low, _), (_, high) = _ways(Decimal(f"{printed:.15g}"))
    return float(low), float(high)


def interval_of(printed: float, target: float | None, error_percent: str | None) -> Interval:
    """Return the numbers that are printed so with this error, each rounded or cut off.

    An error that is no number, or that no such number has, says nothing.
    """
    values = _ways(Decimal(f"{printed:.15g}"))
    found = []
    with suppress(InvalidOperation, TypeError):
        # The paper's signs differ; on which side a value lies it shows itself.
        errors = _ways(abs(Decimal(error_percent or "unknown")))
        true = Decimal(f"{target:.15g}" if target else "unknown")
        sign = -1 if printed < true else 1
        for value, error in product(values, errors):
            ends = sorted(true * (1 + sign * end / 100) for end in error)
            found.append((max(value[0], ends[0]), min(value[1], ends[1])))
    held = [ends for ends in found if ends[0] <= ends[1]] or values
    return float(min(low for low, _ in held)), float(max(high for _, high in held))


def value_in_case(case: Case, names: Sequence[str]) -> tuple[float, float, float] | None:
    """Return the paper's value of a parameter or of a sum, and its interval; None if it has none.

    The value is the printed one if it has the printed error, else the middle of the interval.
    """
    told = case.published
    if not all(name in told.identified for name in names):
        return None
    sums = [0.0, 0.0, 0.0]
    for name in names:
        printed, target = told.identified[name], case.parameters.get(name)
        low, high = interval_of(printed, target, told.error_percent.get(name))
        value = printed if low <= printed <= high else (low + high) / 2
        sums = [total + each for total, each in zip(sums, (value, low, high), strict=True)]
    return sums[0], sums[1], sums[2]


def _ways(printed: Decimal) -> list[tuple[Decimal, Decimal]]:
    """Return the numbers that are printed so if they are rounded, and if they are cut off."""
    step = Decimal(1).scaleb(int(printed.as_tuple().exponent))
    cut = (printed if printed else printed - step, printed + step)
    return [(printed - step / 2, printed + step / 2), cut]
