"""Confidence limits of the optimum's own basin, for all quantities of many traces at once.

The limits of a trace do not depend, to the last bit, on the other traces. If the
optimum's basin leads into a lower one, the limits are those of both basins.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.local_fits import alike
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits
from biogrip.judging.crossings import Brackets, crossings
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.quantities import Quantity

# Accuracy of limits, in standard deviations.
_ACCURACY = 1e-3
# The first step outwards, in standard deviations, and how often it may double.
_FIRST_STEP, _MOST_DOUBLINGS = 2.2, 12


def find_limits(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> tuple[Array, dict[int, Array]]:
    """Find the confidence limits of quantities by profile likelihood, and optima that were missed.

    Parameters
    ----------
    likelihoods
        One per trace, of one or several experiments.
    quantities
        Quantities whose limits are computed.

    Returns
    -------
    limits : (n_traces, n_quantities, 2)
        Logarithms of the lower and upper limits; NaN where the profile stays below the threshold.
    missed
        By trace, log-parameters whose chi^2 is clearly below that of its optimum, which is
        not the global one.
    """
    limits = np.empty((len(likelihoods), len(quantities), 2))
    missed: dict[int, Array] = {}
    if not quantities:
        return limits, missed
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        fits = ConstrainedFits([likelihoods[index] for index in group], quantities)
        limits[group] = _limits(fits).reshape(len(group), -1, 2)
        missed.update({int(group[trace]): x for trace, (_, x) in fits.missed.items()})
    return limits, missed


def _limits(fits: ConstrainedFits) -> Array:
    """Return the lower and upper limit of each profile in turn, (2 n_profiles,)."""
    profile, upper = (index.ravel() for index in np.indices((len(fits.best), 2)))
    stride = _FIRST_STEP * (2 * upper - 1) * fits.deviations()[profile]
    # Inside and outside, by row.
    ends = np.stack((fits.at_best[profile], np.full(len(profile), np.nan)))
    low, high = fits.ranges()[:, profile]
    low, high = np.minimum(low, ends[0]), np.maximum(high, ends[0])
    increases, x = np.zeros_like(ends), np.stack((fits.best[profile], fits.best[profile]))
    limits = np.full(len(profile), np.nan)
    left = np.arange(len(profile))
    for _ in range(_MOST_DOUBLINGS):
        if not len(left):
            break
        tried = np.clip(ends[0, left] + stride[left], low[left], high[left])
        increase, found = fits.at(profile[left], tried, x[0, left], CLOSE)
        side = (increase >= fits.threshold[profile[left]]).astype(np.int64)
        ends[side, left], increases[side, left], x[side, left] = tried, increase, found
        closed = left[side == 1]
        # No additional starts: limits are those of the optimum's own basin.
        brackets = Brackets(profile[closed], ends[:, closed], increases[:, closed], x[:, closed])
        limits[closed] = crossings(fits, brackets, CLOSE, _ACCURACY)
        # If another basin is below the threshold at the outer end, the search continues there.
        on = np.isnan(limits[closed])
        ends[0, closed[on]], increases[0, closed[on]] = (
            brackets.values[1, on],
            brackets.increases[1, on],
        )
        x[0, closed[on]] = brackets.x[1, on]
        stride[left] *= 2
        left = left[np.isnan(limits[left]) & (tried > low[left]) & (tried < high[left])]
    return limits
