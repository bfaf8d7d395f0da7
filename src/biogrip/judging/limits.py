"""Confidence limits of the optimum's own basin, for all quantities of many traces at once.

From the optimum a quantity is moved outwards in doubling steps, with all else fitted from the last
point, until chi^2 has increased by more than the threshold; then `crossings` finds the limit. If
the basin leads into a lower one, the limits are those of both. The limits of a trace do not depend,
to the last bit, on the other traces.

Crossings are found by the Illinois rule [1]_, applied to the square root of the increase of chi^2,
which is nearly linear in the quantity's logarithm: a few fits suffice.

References
----------
.. [1] M. Dowell and P. Jarratt, A modified regula falsi method for computing the root of an
   equation, BIT 11 (1971), 168-174.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.local_fits import FAIR, alike
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.quantities import Quantity

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
    """Find the logarithms of quantities at which the increase of chi^2 equals the threshold, (n,).

    The accuracy is that of the square root of the increase. Lower fits that are found at outer ends
    of brackets replace theirs, in place. NaN is where a deeper basin turns out to be below the
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


# Accuracy of limits, in standard deviations.
_ACCURACY = 1e-3
# The first step outwards, in standard deviations, and how often it may double.
_FIRST_STEP, _MOST_DOUBLINGS = 2.2, 12


def find_limits(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> tuple[Array, dict[int, Array]]:
    """Find the confidence limits of quantities by profile likelihood, and optima that were missed.

    Limits are logarithms, the lower and the upper, (n_traces, n_quantities, 2); NaN where the
    profile stays below the threshold. By trace, log-parameters are returned whose chi^2 is clearly
    below that of its optimum, which is not the global one.
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
