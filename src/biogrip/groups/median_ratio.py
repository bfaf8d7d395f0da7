"""Median ratio of a cell of one dish to a cell of another, by ranks.

Its logarithm is the shift at which a cell of the one is as often above as below a cell of the
other. The estimate is the median of all differences between a cell of one dish and a cell of the
other; its limits invert the rank test of Brunner and Munzel, which allows for distributions of
any shape and spread. If both are symmetric, or alike but for a shift, it is the ratio of medians.
It ignores estimation errors of the cells.

References
----------
.. [1] J. L. Hodges and E. L. Lehmann, Estimates of location based on rank tests, Annals of
   Mathematical Statistics 34 (1963), 598-611: the estimate.
.. [2] E. Brunner and U. Munzel, The nonparametric Behrens-Fisher problem: asymptotic theory and
   a small-sample approximation, Biometrical Journal 42 (2000), 17-25.
"""

import warnings
from bisect import bisect_left
from dataclasses import dataclass
from functools import partial

import numpy as np

from biogrip.arrays import Array


@dataclass(frozen=True)
class Shift:
    """Shift between the values of two samples."""

    estimate: float
    """Median of the differences."""
    low: float | None
    """Lower confidence limit; None if there are too few cells."""
    high: float | None
    """Upper one, likewise."""


def shift(one: Array, other: Array, confidence: float) -> Shift:
    """Estimate the shift of a sample (n,) over another (m,)."""
    differences = np.sort(np.subtract.outer(one, other).ravel())
    estimate = float(np.median(differences))
    # Beside values that hardly scatter, n others are all on one side of the shift with this chance.
    if 0.5 ** (min(len(one), len(other)) - 1) > 1 - confidence:
        return Shift(estimate, None, None)
    # No shift beyond the outermost differences is allowed: all of one sample would be on one side.
    between = (differences[:-1] + differences[1:]) / 2
    middle = len(between) // 2
    p_values = partial(_p_value, one, other)
    low = bisect_left(between, 1 - confidence, hi=middle, key=p_values)
    high = bisect_left(between[::-1], 1 - confidence, hi=middle, key=p_values)
    return Shift(estimate, float(differences[low]), float(differences[-1 - high]))


def _p_value(one: Array, other: Array, shifted_by: float) -> float:
    """Return the p value of the hypothesis that this is the shift; 0 if ranks do not overlap."""
    from scipy.stats import brunnermunzel

    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)
        return float(np.nan_to_num(brunnermunzel(one - shifted_by, other).pvalue))
