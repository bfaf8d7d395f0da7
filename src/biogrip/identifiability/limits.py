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


def near_limits(
    likelihoods: Sequence[Likelihood],
    quantities: Sequence[Quantity],
    tolerance: float = CLOSE,
    accuracy: float = _ACCURACY,
    fits: HeldFits | None = None,
) -> Array:
    """Find where the rise of chi^2 equals the threshold.

    Parameters
    ----------
    likelihoods
        One a trace; their problems have to be `alike`.
    quantities
        Whose limits are wanted.
    tolerance
        Of the fits, see `biogrip.identify.local_fits`.
    accuracy
        Of the square root of the rise.
    fits
        Those that are to be used; they know afterwards which optima were missed.

    Returns
    -------
    (n_traces, n_quantities, 2)
        Logarithms of the lower and upper limits; NaN where the trace does not close the profile.
    """
    fits = fits or HeldFits(likelihoods, quantities)
    shape = (len(likelihoods), len(quantities), 2)
    trace, which, upper = (index.ravel() for index in np.indices(shape))
    stride = _FIRST_STEP * (2 * upper - 1) * fits.deviations()[trace, which]
    # Inside and outside, by row.
    ends = np.stack((fits.at_best()[trace, which], np.full(len(trace), np.nan)))
    low, high = (end[which] for end in fits.ranges())
    low, high = np.minimum(low, ends[0]), np.maximum(high, ends[0])
    rises, x = np.zeros_like(ends), np.stack((fits.best[trace], fits.best[trace]))
    limits = np.full(len(trace), np.nan)
    left = np.arange(len(trace))
    for _ in range(_MOST_DOUBLINGS):
        if not len(left):
            break
        tried = np.clip(ends[0, left] + stride[left], low[left], high[left])
        rise, found = fits.at(trace[left], which[left], tried, x[0, left], tolerance)
        side = (rise >= fits.threshold[trace[left]]).astype(np.int64)
        ends[side, left], rises[side, left], x[side, left] = tried, rise, found
        closed = left[side == 1]
        # Limits are those of the optimum's own basin.
        nowhere_else = np.empty((0, len(closed), x.shape[2]))
        brackets = Brackets(
            trace[closed],
            which[closed],
            ends[0, closed],
            ends[1, closed],
            rises[0, closed],
            rises[1, closed],
            x[0, closed],
            x[1, closed],
            nowhere_else,
        )
        crossed = crossings(fits, brackets, tolerance, accuracy)
        limits[closed] = crossed.at
        # Where another basin is below the threshold there, that is the way on.
        on = np.isnan(crossed.at)
        ends[0, closed[on]], rises[0, closed[on]] = brackets.outside[on], crossed.outside_rise[on]
        x[0, closed[on]] = crossed.outside_x[on]
        stride[left] *= 2
        left = left[np.isnan(limits[left]) & (tried > low[left]) & (tried < high[left])]
    return limits.reshape(shape)


def limits_of(likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> Array:
    """Limits as of `limits_and_deeper`."""
    return limits_and_deeper(likelihoods, quantities)[0]


def limits_and_deeper(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> tuple[Array, dict[int, Array]]:
    """Find limits, and what is deeper than the optima that they are about.

    Parameters
    ----------
    likelihoods
        One a trace, of any number of experiments.
    quantities
        Whose limits are wanted.

    Returns
    -------
    limits : (n_traces, n_quantities, 2)
        As of `near_limits`.
    deeper
        By trace, log-parameters whose chi^2 is clearly below that of its optimum, so that
        this was missed.
    """
    limits = np.empty((len(likelihoods), len(quantities), 2))
    deeper: dict[int, Array] = {}
    if not quantities:
        return limits, deeper
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        own = [likelihoods[index] for index in group]
        fits = HeldFits(own, quantities)
        limits[group] = near_limits(own, quantities, fits=fits)
        deeper.update({int(group[trace]): x for trace, (_, x) in fits.deeper.items()})
    return limits, deeper
