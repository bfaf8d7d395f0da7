"""How far two dishes are apart whatever the distribution of their cells: Hodges and Lehmann.

The estimate is the median of all differences between a cell of one and a cell of the other; its
limits are those of the differences at which the rank test of Wilcoxon, Mann and Whitney turns.
It checks what rests on normal distributions, and takes no account of the errors of the cells.

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
    """By how much the values of one sample exceed those of another.

    Parameters
    ----------
    estimate
        Median of the differences.
    low, high
        Confidence limits; None where there are too few cells for any.
    """

    estimate: float
    low: float | None
    high: float | None


def shift(one: Array, other: Array, confidence: float) -> Shift:
    """Estimate a shift from samples of shapes (n,) and (m,)."""
    differences = np.sort(np.subtract.outer(one, other).ravel())
    outside = (1 - confidence) / 2
    # So many differences may be left out at either end.
    left_out = int(np.sum(np.cumsum(_chances(len(one), len(other))) <= outside))
    estimate = float(np.median(differences))
    if not left_out:
        return Shift(estimate, None, None)
    return Shift(estimate, float(differences[left_out - 1]), float(differences[-left_out]))


def _chances(first: int, second: int) -> Array:
    """Probability of every value of the rank statistic U if the samples are alike, (n m + 1,)."""
    # Ways to choose `first` of the ranks by their sum, less the smallest; one rank after another.
    ways = np.zeros((first + 1, first * second + 1))
    ways[0, 0] = 1.0
    for rank in range(first + second):
        for chosen in range(min(first, rank + 1), 0, -1):
            # The rank takes the place `chosen`, so many places above where it could be at least.
            by = rank - (chosen - 1)
            if by <= second:
                ways[chosen, by:] += ways[chosen - 1, : ways.shape[1] - by]
    return ways[first] / np.sum(ways[first])
