"""Confidence limits of the optimum's own basin, for all quantities of many traces at once.

From the optimum outwards until the rise of chi^2 exceeds the threshold, then by the
Illinois rule (Dowell & Jarratt 1971) to where it equals it. The square root of the
rise is nearly linear, so a few fits suffice. To the last bit, the limits for a
trace do not depend on which others there are.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.held_fits import HeldFits
from biogrip.identifiability.profile import Likelihood
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import FAIR

# The square root of the rise, in standard deviations, is met to this.
_ACCURACY = 2e-3
_MOST_FITS = 40


def many_limits(
    likelihoods: Sequence[Likelihood],
    quantities: Sequence[Quantity],
    tolerance: float = FAIR,
    accuracy: float = _ACCURACY,
) -> Array:
    """Find where the rise of chi^2 equals the threshold.

    Parameters
    ----------
    likelihoods
        One a trace.
    quantities
        Whose limits are wanted.
    tolerance
        Of the fits, see `local_fit`.
    accuracy
        Of the square root of the rise.

    Returns
    -------
    (n_traces, n_quantities, 2)
        Logarithms of the lower and upper limits; NaN where the trace does not close the profile.
    """
    fits = HeldFits(likelihoods, quantities)
    shape = (len(likelihoods), len(quantities), 2)
    trace, which, side = (index.ravel() for index in np.indices(shape))
    sign = 2 * side - 1
    low, high = (end[which] for end in fits.ranges())
    inner = fits.at_best()[trace, which]
    stride = 2.2 * fits.deviations()[trace, which]
    wanted = np.sqrt(fits.threshold)[trace]
    near = fits.best[trace]
    # Ends of the bracket, and by how much the square root of the rise exceeds what is wanted.
    inner_excess, outer, outer_excess = -wanted, np.full_like(inner, np.nan), wanted.copy()
    moved_last = np.zeros_like(side)
    limits = np.full(len(inner), np.nan)
    left = np.arange(len(inner))
    for _ in range(_MOST_FITS):
        known = np.isfinite(outer[left])
        ahead = np.clip(inner[left] + sign[left] * stride[left], low[left], high[left])
        share = inner_excess[left] / (inner_excess[left] - outer_excess[left])
        between = inner[left] + share * (outer[left] - inner[left])
        tried = np.where(known, between, ahead)
        rises, found = fits.at(trace[left], which[left], tried, near[left], tolerance)
        excess = np.sqrt(np.maximum(rises, 0.0)) - wanted[left]
        met = np.abs(excess) <= accuracy
        limits[left[met]] = tried[met]
        beyond, within = left[excess > 0], left[excess <= 0]
        # An end that stays a second time counts half, so that it moves, too.
        inner_excess[beyond[moved_last[beyond] > 0]] *= 0.5
        outer_excess[within[moved_last[within] < 0]] *= 0.5
        outer[beyond], outer_excess[beyond], moved_last[beyond] = (
            tried[excess > 0],
            excess[excess > 0],
            1,
        )
        inner[within], inner_excess[within] = tried[excess <= 0], excess[excess <= 0]
        near[within], moved_last[within] = found[excess <= 0], -1
        stride[within] *= 2
        open_end = ~known & (excess <= 0) & ((tried <= low[left]) | (tried >= high[left]))
        left = left[~met & ~open_end]
        if not len(left):
            break
    limits[left] = 0.5 * (inner[left] + outer[left])
    return limits.reshape(shape)
