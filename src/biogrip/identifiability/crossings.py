"""Where profiles reach their thresholds, for any number of brackets at once.

By the Illinois rule (Dowell & Jarratt 1971) on the square root of the rise of
chi^2, which is nearly linear in the quantity's logarithm: a few fits suffice.

References
----------
.. [1] M. Dowell and P. Jarratt, A modified regula falsi method for computing the root of an
   equation, BIT 11 (1971), 168-174.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.identifiability.held_fits import HeldFits

_MOST_FITS = 40
_CLOSEST = 1e-7


@dataclass(frozen=True)
class Brackets:
    """Stretches of n profiles in which they cross the threshold.

    Parameters
    ----------
    trace, which : (n,)
        Which trace, and which quantity.
    inside, outside : (n,)
        Logarithms of the quantity below and above the threshold, on either side of each other.
    inside_rise, outside_rise : (n,)
        Rises of chi^2 there.
    inside_x, outside_x : (n, n_parameters)
        Log-parameters fitted there.
    """

    trace: IntArray
    which: IntArray
    inside: Array
    outside: Array
    inside_rise: Array
    outside_rise: Array
    inside_x: Array
    outside_x: Array


def crossings(fits: HeldFits, brackets: Brackets, tolerance: float, accuracy: float) -> Array:
    """Find where the rise equals the threshold.

    Parameters
    ----------
    fits
        The traces and quantities.
    brackets
        Where to look.
    tolerance
        Of the fits, see `local_fit`.
    accuracy
        Of the square root of the rise.

    Returns
    -------
    (n,)
        Logarithms of the quantities.
    """
    trace, which = brackets.trace, brackets.which
    wanted = np.sqrt(fits.threshold[trace])
    # Inside and outside, by row.
    ends = np.stack((brackets.inside, brackets.outside))
    x = np.stack((brackets.inside_x, brackets.outside_x))
    excess = np.sqrt(np.maximum((brackets.inside_rise, brackets.outside_rise), 0.0)) - wanted
    moved = np.full(len(trace), -1)
    found = ends[1].copy()
    left = np.arange(len(trace))
    for _ in range(_MOST_FITS):
        if not len(left):
            break
        share = excess[0, left] / (excess[0, left] - excess[1, left])
        tried = ends[0, left] + share * (ends[1, left] - ends[0, left])
        # The fits of the two ends may lie in different basins: what counts is the deeper one.
        between = x[0, left] + share[:, None] * (x[1, left] - x[0, left])
        starts = np.concatenate((between, x[0, left], x[1, left]))
        all_rises, all_fitted = fits.at(
            np.tile(trace[left], 3), np.tile(which[left], 3), np.tile(tried, 3), starts, tolerance
        )
        all_rises, all_fitted = all_rises.reshape(3, -1), all_fitted.reshape(3, len(left), -1)
        deepest = np.argmin(all_rises, axis=0)
        rises, fitted = all_rises[deepest, range(len(left))], all_fitted[deepest, range(len(left))]
        over = np.sqrt(np.maximum(rises, 0.0)) - wanted[left]
        found[left] = tried
        side = (over > 0).astype(np.int64)
        ends[side, left], excess[side, left], x[side, left] = tried, over, fitted
        # An end that stays a second time counts half, so that it moves, too.
        again = moved[left] == side
        excess[1 - side[again], left[again]] *= 0.5
        moved[left] = side
        # Where a deeper basin begins the rise may jump past the threshold.
        apart = np.abs(ends[1, left] - ends[0, left]) > _CLOSEST
        left = left[(np.abs(over) > accuracy) & apart]
    return found
