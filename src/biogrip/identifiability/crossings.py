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
from biogrip.identify.local_fits import FAIR

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
    elsewhere : (n_starts, n, n_parameters)
        Log-parameters from which fits are tried as well, where what they lead to may be deeper.
    """

    trace: IntArray
    which: IntArray
    inside: Array
    outside: Array
    inside_rise: Array
    outside_rise: Array
    inside_x: Array
    outside_x: Array
    elsewhere: Array


@dataclass(frozen=True)
class Crossings:
    """Where n profiles cross the threshold within their brackets.

    Parameters
    ----------
    at : (n,)
        Logarithms of the quantities; NaN where a basin seen on the way is below the threshold
        at the outer end, so that the crossing lies further out.
    outside_rise : (n,)
        Rises at the outer ends, as low as they are known now.
    outside_x : (n, n_parameters)
        Log-parameters fitted there.
    """

    at: Array
    outside_rise: Array
    outside_x: Array


def crossings(fits: HeldFits, brackets: Brackets, tolerance: float, accuracy: float) -> Crossings:
    """Find where the rise equals the threshold.

    Parameters
    ----------
    fits
        The traces and quantities.
    brackets
        Where to look.
    tolerance
        Of the fits, see `biogrip.identify.local_fits`.
    accuracy
        Of the square root of the rise.
    """
    trace = brackets.trace
    wanted = np.sqrt(fits.threshold[trace])
    # Inside and outside, by row.
    ends = np.stack((brackets.inside, brackets.outside))
    x = np.stack((brackets.inside_x, brackets.outside_x))
    excess = np.sqrt(np.maximum((brackets.inside_rise, brackets.outside_rise), 0.0)) - wanted
    moved = np.full(len(trace), -1)
    found = ends[1].copy()
    outermost = brackets.outside_rise.copy(), brackets.outside_x.copy()
    left = np.arange(len(trace))
    for tries in range(_MOST_FITS):
        if not len(left):
            break
        share = excess[0, left] / (excess[0, left] - excess[1, left])
        tried = ends[0, left] + share * (ends[1, left] - ends[0, left])
        # The fits of the two ends may lie in different basins: what counts is the deeper one.
        between = x[0, left] + share[:, None] * (x[1, left] - x[0, left])
        starts = np.concatenate((between[None], x[:, left]))
        # What the first fit finds from elsewhere is followed by the others.
        if not tries and len(brackets.elsewhere):
            elsewhere = brackets.elsewhere[:, left]
            rises, fitted = _fitted_from(fits, brackets, left, tried, elsewhere, FAIR)
            deepest = fitted[np.argmin(rises, axis=0), range(len(left))]
            starts = np.concatenate((starts, deepest[None]))
        all_rises, all_fitted = _fitted_from(fits, brackets, left, tried, starts, tolerance)
        deepest = np.argmin(all_rises, axis=0)
        rises, fitted = all_rises[deepest, range(len(left))], all_fitted[deepest, range(len(left))]
        over = np.sqrt(np.maximum(rises, 0.0)) - wanted[left]
        # What is deeper than the basin of the outer end may be so at the outer end, too.
        deeper = np.sqrt(np.maximum(all_rises[2], 0.0)) - wanted[left] > over + accuracy
        _lower(fits, brackets, outermost, left[deeper], fitted[deeper], tolerance)
        void = outermost[0][left] < fits.threshold[trace[left]]
        found[left] = np.where(void, np.nan, tried)
        side = (over > 0).astype(np.int64)
        ends[side, left], excess[side, left], x[side, left] = tried, over, fitted
        # An end that stays a second time counts half, so that it moves, too.
        again = moved[left] == side
        excess[1 - side[again], left[again]] *= 0.5
        moved[left] = side
        # Where a deeper basin begins the rise may jump past the threshold.
        apart = np.abs(ends[1, left] - ends[0, left]) > _CLOSEST
        left = left[(np.abs(over) > accuracy) & apart & ~void]
    return Crossings(found, *outermost)


def _fitted_from(
    fits: HeldFits,
    brackets: Brackets,
    which: IntArray,
    targets: Array,
    starts: Array,
    tolerance: float,
) -> tuple[Array, Array]:
    """Fit some brackets' quantities from starts (n_starts, n, n_parameters), as `HeldFits.at`."""
    count = len(starts)
    rises, fitted = fits.at(
        np.tile(brackets.trace[which], count),
        np.tile(brackets.which[which], count),
        np.tile(targets, count),
        np.concatenate(starts),
        tolerance,
    )
    return rises.reshape(count, -1), fitted.reshape(starts.shape)


def _lower(
    fits: HeldFits,
    brackets: Brackets,
    outermost: tuple[Array, Array],
    which: IntArray,
    starts: Array,
    tolerance: float,
) -> None:
    """Fit outer ends of some brackets from other starts, too; in place, the lower fit counts."""
    if not len(which):
        return
    trace, quantity = brackets.trace[which], brackets.which[which]
    rises, x = fits.at(trace, quantity, brackets.outside[which], starts, tolerance)
    lower = rises < outermost[0][which]
    outermost[0][which[lower]], outermost[1][which[lower]] = rises[lower], x[lower]
