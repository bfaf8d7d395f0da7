"""Difference between two dishes by ranks: the Hodges-Lehmann estimator.

The estimate is the median of all differences between a cell of one dish and a cell of the other.
Its limits invert the rank test of Wilcoxon, Mann and Whitney. It checks results that assume
normal distributions. It assumes that the dishes differ by a shift alone: if their spreads
differ, the interval is too narrow. It ignores estimation errors of the cells.

References
----------
.. [1] J. L. Hodges and E. L. Lehmann, Estimates of location based on rank tests, Annals of
   Mathematical Statistics 34 (1963), 598-611.
.. [2] M. Hollander, D. A. Wolfe and E. Chicken, Nonparametric Statistical Methods, 3rd ed.,
   Wiley, 2014, section 4.3.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array


@dataclass(frozen=True)
class Shift:
    """Shift between the values of two samples.

    Parameters
    ----------
    estimate
        Median of the differences.
    low, high
        Confidence limits; None if there are too few cells.
    """

    estimate: float
    low: float | None
    high: float | None


def shift(one: Array, other: Array, confidence: float) -> Shift:
    """Estimate the shift of a sample (n,) over another (m,)."""
    differences = np.sort(np.subtract.outer(one, other).ravel())
    outside = (1 - confidence) / 2
    # Number of differences outside the limits at either end.
    left_out = int(np.sum(np.cumsum(_chances(len(one), len(other))) <= outside))
    estimate = float(np.median(differences))
    if not left_out:
        return Shift(estimate, None, None)
    return Shift(estimate, float(differences[left_out - 1]), float(differences[-left_out]))


def _chances(first: int, second: int) -> Array:
    """Return the null distribution of the rank statistic U, (n m + 1,)."""
    # Count selections of `first` ranks by rank sum minus the smallest sum, adding rank by rank.
    ways = np.zeros((first + 1, first * second + 1))
    ways[0, 0] = 1.0
    for rank in range(first + second):
        for chosen in range(min(first, rank + 1), 0, -1):
            # As the `chosen`-th smallest, the rank lies this many places above its lowest position.
            by = rank - (chosen - 1)
            if by <= second:
                ways[chosen, by:] += ways[chosen - 1, : ways.shape[1] - by]
    return ways[first] / np.sum(ways[first])
