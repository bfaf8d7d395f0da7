"""Power of the comparison of two dishes, and number of cells needed for a given power.

Of n cells a dish that scatter by the spread tau, each estimated with the error s, the logarithm
of the ratio of medians has the variance 2 (tau^2 + s^2)/n, and t is distributed with 2 (n - 1)
degrees of freedom about ln(ratio) in units of its root: the noncentral t. Where errors differ
from cell to cell, badly known cells count less, and the power is more than with their root mean
square.

With Z normal and V of chi-squared with f degrees of freedom that t is (Z + m)/sqrt(V/f), and
exceeds a limit c either way where V < f ((Z + m)/c)^2: the power is the mean over Z of a
probability of chi-squared. Nothing in it cancels, underflows or grows, where implementations of
the noncentral t come to nan.

References
----------
.. [1] J. Cohen, Statistical Power Analysis for the Behavioral Sciences, 2nd ed., Erlbaum, 1988,
   chapter 2.
"""

from bisect import bisect_left
from math import ceil, exp, hypot, log, sqrt

import numpy as np

from biogrip.groups.population import FEWEST_CELLS


def power(ratio: float, cells: int, spread: float, error: float, confidence: float = 0.95) -> float:
    """Return the probability that a difference between two populations is detected.

    Parameters
    ----------
    ratio
        Ratio of the medians of the populations.
    cells
        Number of cells per dish, at least 2.
    spread
        Standard deviation of the logarithm between cells.
    error
        Standard deviation of each cell's estimate.
    confidence
        Confidence level of the interval that must exclude 1.
    """
    return _power(abs(log(ratio)) / hypot(spread, error), cells, confidence)


def _power(size: float, cells: int, confidence: float) -> float:
    from scipy.special import chdtr, stdtrit

    freedom = 2 * (cells - 1)
    limit = float(stdtrit(freedom, (1 + confidence) / 2))
    # With two steps per width of the narrower factor the trapezoidal rule errs by less than 1e-10,
    # and cutting at 9 standard deviations by 2e-19.
    step = min(1.0, limit / sqrt(2 * freedom)) / 2
    z = step * np.arange(-ceil(9 / step), ceil(9 / step) + 1)
    weights = np.exp(-z * z / 2)
    found = chdtr(freedom, freedom * ((z + size * sqrt(cells / 2)) / limit) ** 2)
    return float(np.sum(weights * found) / np.sum(weights))


def cells_needed(
    ratio: float, target: float, spread: float, error: float, confidence: float = 0.95
) -> int:
    """Return the number of cells per dish needed to detect a difference with a given power.

    It is at least `FEWEST_CELLS`, the fewest that are compared.

    Parameters
    ----------
    ratio, spread, error, confidence
        Arguments of `power`; the ratio is not 1.
    target
        Power, e.g. 0.8.
    """
    most = FEWEST_CELLS
    while power(ratio, most, spread, error, confidence) < target:
        most *= 2
    allowed = range(max(FEWEST_CELLS, most // 2), most + 1)
    # More cells show more.
    return allowed[
        bisect_left(allowed, target, key=lambda n: power(ratio, n, spread, error, confidence))
    ]


def detectable_ratio(
    cells: int, target: float, spread: float, error: float, confidence: float = 0.95
) -> float:
    """Return the smallest ratio above 1 detected with a given power; see `cells_needed`."""
    from scipy.optimize import brentq

    large = 1.0
    while _power(large, cells, confidence) < target:
        large *= 2
    size = brentq(lambda size: _power(size, cells, confidence) - target, 0.0, large, xtol=1e-12)
    return exp(float(size) * hypot(spread, error))
