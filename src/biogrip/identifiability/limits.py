"""Confidence limits of the optimum's own basin, for all quantities of many traces at once.

To the last bit, the limits for a trace do not depend on which others there are. Where
that basin leads over into a lower one, they are the limits of both.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.crossings import Brackets, crossings
from biogrip.identifiability.held_fits import CLOSE, HeldFits
from biogrip.identifiability.likelihood import Likelihood
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fits import alike

# Limits to a thousandth of a standard deviation.
_ACCURACY = 1e-3
# The first step outwards, in standard deviations, and how often it may double.
_FIRST_STEP, _MOST_DOUBLINGS = 2.2, 12


def limits_and_deeper(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> tuple[Array, dict[int, Array]]:
    """Find where the rise of chi^2 equals the threshold, and what is deeper than the optima.

    Parameters
    ----------
    likelihoods
        One a trace, of any number of experiments.
    quantities
        Whose limits are wanted.

    Returns
    -------
    limits : (n_traces, n_quantities, 2)
        Logarithms of the lower and upper limits; NaN where the trace does not close the profile.
    deeper
        By trace, log-parameters whose chi^2 is clearly below that of its optimum, so that
        this was missed.
    """
    limits = np.empty((len(likelihoods), len(quantities), 2))
    deeper: dict[int, Array] = {}
    if not quantities:
        return limits, deeper
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        fits = HeldFits([likelihoods[index] for index in group], quantities)
        limits[group] = _limits(fits).reshape(len(group), -1, 2)
        deeper.update({int(group[trace]): x for trace, (_, x) in fits.deeper.items()})
    return limits, deeper


def _limits(fits: HeldFits) -> Array:
    """Lower and upper limits by profile, one after the other, (2 n_profiles,)."""
    profile, upper = (index.ravel() for index in np.indices((len(fits.best), 2)))
    stride = _FIRST_STEP * (2 * upper - 1) * fits.deviations()[profile]
    # Inside and outside, by row.
    ends = np.stack((fits.at_best[profile], np.full(len(profile), np.nan)))
    low, high = fits.ranges()[:, profile]
    low, high = np.minimum(low, ends[0]), np.maximum(high, ends[0])
    rises, x = np.zeros_like(ends), np.stack((fits.best[profile], fits.best[profile]))
    limits = np.full(len(profile), np.nan)
    left = np.arange(len(profile))
    for _ in range(_MOST_DOUBLINGS):
        if not len(left):
            break
        tried = np.clip(ends[0, left] + stride[left], low[left], high[left])
        rise, found = fits.at(profile[left], tried, x[0, left], CLOSE)
        side = (rise >= fits.threshold[profile[left]]).astype(np.int64)
        ends[side, left], rises[side, left], x[side, left] = tried, rise, found
        closed = left[side == 1]
        # From nowhere else: limits are those of the optimum's own basin.
        brackets = Brackets(profile[closed], ends[:, closed], rises[:, closed], x[:, closed])
        limits[closed] = crossings(fits, brackets, CLOSE, _ACCURACY)
        # Where another basin is below the threshold there, that is the way on.
        on = np.isnan(limits[closed])
        ends[0, closed[on]], rises[0, closed[on]] = brackets.values[1, on], brackets.rises[1, on]
        x[0, closed[on]] = brackets.x[1, on]
        stride[left] *= 2
        left = left[np.isnan(limits[left]) & (tried > low[left]) & (tried < high[left])]
    return limits
