"""Root finding for the values at which profiles cross their thresholds, many at once.

The Illinois rule [1]_ is applied to the square root of the increase of chi^2, which is
nearly linear in the quantity's logarithm: a few fits suffice.

References
----------
.. [1] M. Dowell and P. Jarratt, A modified regula falsi method for computing the root of an
   equation, BIT 11 (1971), 168-174.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.local_fits import FAIR
from biogrip.judging.constrained_fits import ConstrainedFits

_MOST_FITS = 40
_CLOSEST = 1e-7


@dataclass
class Brackets:
    """Intervals in which n profiles cross their thresholds, each with an inner and an outer end."""

    profile: IntArray
    """Index of the profile in `ConstrainedFits`, (n,)."""
    values: Array
    """Logarithms of the quantity at the inner end, below the threshold, and the outer, above, (2,
    n)."""
    increases: Array
    """Increases of chi^2 there, (2, n)."""
    x: Array
    """Log-parameters fitted there, (2, n, n_parameters)."""
    elsewhere: Array | None = None
    """Log-parameters of additional starts that may lead to deeper basins, (n_starts, n,
    n_parameters) or None."""


def crossings(
    fits: ConstrainedFits, brackets: Brackets, tolerance: float, accuracy: float
) -> Array:
    """Find the values of quantities at which the increase of chi^2 equals the threshold.

    Parameters
    ----------
    fits
        The traces and quantities.
    brackets
        Intervals to search; lower fits that are found at outer ends replace theirs, in place.
    tolerance
        Of the fits, see `biogrip.fit.local_fits`.
    accuracy
        Of the square root of the increase of chi^2.

    Returns
    -------
    (n,)
        Logarithms of the quantities; NaN where a deeper basin turns out to be below the
        threshold at the outer end, so that the crossing lies further out.
    """
    profile, threshold = brackets.profile, fits.threshold[brackets.profile]
    root_threshold = np.sqrt(threshold)
    ends, x = brackets.values.copy(), brackets.x.copy()
    excess = np.sqrt(np.maximum(brackets.increases, 0.0)) - root_threshold
    moved = np.full(len(profile), -1)
    found = ends[1].copy()
    left = np.arange(len(profile))
    for tries in range(_MOST_FITS):
        if not len(left):
            break
        share = excess[0, left] / (excess[0, left] - excess[1, left])
        tried = ends[0, left] + share * (ends[1, left] - ends[0, left])
        # The fits of the two ends may lie in different basins: the deeper one counts.
        between = x[0, left] + share[:, None] * (x[1, left] - x[0, left])
        starts = np.concatenate((between[None], x[:, left]))
        # In the first round, the best fit from elsewhere is one more start.
        if not tries and brackets.elsewhere is not None:
            _, deepest = fits.from_each(profile, tried, brackets.elsewhere, FAIR)
            starts = np.concatenate((starts, deepest[None]))
        increases, fitted = fits.from_each(profile[left], tried, starts, tolerance)
        over = np.sqrt(np.maximum(np.min(increases, axis=0), 0.0)) - root_threshold[left]
        # A basin deeper than that of the outer end may be deeper at the outer end, too.
        missed = np.sqrt(np.maximum(increases[2], 0.0)) - root_threshold[left] > over + accuracy
        _lower(fits, brackets, left[missed], fitted[missed], tolerance)
        void = brackets.increases[1, left] < threshold[left]
        found[left] = np.where(void, np.nan, tried)
        side = (over > 0).astype(np.int64)
        ends[side, left], excess[side, left], x[side, left] = tried, over, fitted
        # The excess of an end that stays a second time is halved, so that the end moves, too.
        again = moved[left] == side
        excess[1 - side[again], left[again]] *= 0.5
        moved[left] = side
        # Where a deeper basin begins, the increase may jump past the threshold.
        apart = np.abs(ends[1, left] - ends[0, left]) > _CLOSEST
        left = left[(np.abs(over) > accuracy) & apart & ~void]
    return found


def _lower(
    fits: ConstrainedFits, brackets: Brackets, which: IntArray, starts: Array, tolerance: float
) -> None:
    """Fit the outer ends of brackets from other starts and keep, in place, the lower fits."""
    if not len(which):
        return
    increases, x = fits.at(brackets.profile[which], brackets.values[1, which], starts, tolerance)
    lower = increases < brackets.increases[1, which]
    brackets.increases[1, which[lower]], brackets.x[1, which[lower]] = increases[lower], x[lower]
