"""Scales and limits of axes, for figures and for pages that draw in a browser."""

from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.figures.results import Fit, scale_of

HIGHEST_INCREASE = 12.0
"""End of the axis of profiles."""
# Ratio of the longest to the shortest interval from which times are drawn on a logarithmic scale.
_SPARSER = 30.0
# Ratio of the ends above which an axis of a profile is logarithmic.
_WIDE = 5.0


def is_over_decades(time_s: Array) -> bool:
    """Return True for times that are dense at first and sparse at last, after zero."""
    return bool(time_s[0] > 0 and np.max(np.diff(time_s)) > _SPARSER * np.min(np.diff(time_s)))


def is_wide(low: float, high: float) -> bool:
    """Return True for limits of a profile that ask for a logarithmic axis."""
    return high / low > _WIDE


def scale_of_fit(fit: Fit) -> tuple[float, str]:
    """Return factor and unit with a prefix, where the unit of the readings may have one."""
    plain = fit.read.unit.isalpha()
    return scale_of(fit.fitted_rad, fit.read.unit) if plain else (1.0, fit.read.unit)


def profile_limits(item: dict[str, Any]) -> tuple[float, float]:
    """Return limits of the x-axis: where the profile is inside the figure, plus a margin."""
    values, increases = (np.array(item["profile"][key]) for key in ("values", "increases"))
    inside = np.flatnonzero(increases < HIGHEST_INCREASE)
    ends = [item["low"], item["high"], values[inside[0]], values[inside[-1]]]
    low, high = (float(end([x for x in ends if x is not None])) for end in (min, max))
    margin = max((high / low) ** 0.05, 1.0002)
    return max(float(values[0]), low / margin), min(float(values[-1]), high * margin)
