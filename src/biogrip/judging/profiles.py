"""Profile likelihood: minimum of chi^2 over all parameters against one quantity [1]_, [2]_.

All quantities of many traces are profiled at once, over their whole search ranges. All points are
fitted from the optimum, then from the fits of both neighbours, again and again where these have
improved: a basin found anywhere in a profile is followed both ways. Where a profile exceeds the
certainty at an end, its limit is where it crosses the threshold. The limits are the outermost:
values between them may be excluded, too, which gaps tell.

Crossings are found by the Illinois rule [3]_, applied to the square root of the increase of chi^2,
which is nearly linear in the quantity's logarithm: a few fits suffice.

References
----------
.. [1] D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37 (1988), 87-94.
.. [2] A. Raue et al., Bioinformatics 25 (2009), 1923-1929.
.. [3] M. Dowell and P. Jarratt, BIT 11 (1971), 168-174.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.least_squares import FAIR, FINE, alike
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.quantities import Quantity

HIGHEST = 16.0
"""Increase of chi^2 up to which a profile has dense points, as figures show no more."""

# Largest difference between neighbours of the square root of the increase, which is nearly linear.
_ROOT_STEP = 0.3
_MOST_HALVINGS = 8
# Improvement of a fit, relative to 1 + increase of chi^2, that has its neighbours fitted again.
_LEAST_IMPROVEMENT = 1e-3


class Points:
    """Points of several profiles, one profile after the other, with their best fits so far.

    Grids are ascending logarithms of each quantity, with that of the optimum. A point has the index
    of its `profile`, one of `values`, and of its best fit `increases` and `x`, (n_points,
    n_parameters).
    """

    def __init__(self, fits: ConstrainedFits, grids: Sequence[Array]) -> None:
        self.fits = fits
        self.profile = np.repeat(np.arange(len(grids)), [len(grid) for grid in grids])
        self.values = np.concatenate(grids)
        self.x = fits.best[self.profile]
        self._optimum = self.values == fits.at_best[self.profile]
        self.increases = np.where(self._optimum, 0.0, np.inf)

    def from_optimum(self) -> None:
        """Fit every point but the optimum, starting from the optimum."""
        point = np.flatnonzero(~self._optimum)
        self._try(point, point, FAIR)

    def from_neighbours(self, news: BoolArray | None = None) -> None:
        """Fit points from their neighbours' fits, of all or of some, as long as these improve."""
        # Optima, and places beyond the ends, belong to no profile here: they are not fitted.
        to_fit = np.append(np.where(self._optimum, -1, self.profile), -1)
        news = np.full(len(self.values), True) if news is None else news
        while np.any(news):
            start = np.tile(np.flatnonzero(news), 2)
            point = start + np.repeat((-1, 1), len(start) // 2)
            beside = to_fit[point] == self.profile[start]
            news = self._try(point[beside], start[beside], CLOSE)

    def _try(self, point: IntArray, start: IntArray, tolerance: float) -> BoolArray:
        """Fit points from other points' fits; return a mask of those that have improved much."""
        profile, targets = self.profile[point], self.values[point]
        fits = self.fits.at(profile, targets, self.x[start], tolerance)
        return keep_lower(self.increases, self.x, point, *fits)

    def ends(self) -> IntArray:
        """Return the indices of the first and last point of every profile, (2, n_profiles)."""
        every = np.arange(len(self.fits.best))
        last = np.searchsorted(self.profile, every, side="right") - 1
        return np.stack((np.searchsorted(self.profile, every), last))

    def extremes(self) -> Array:
        """Return the fits at both ends of profiles, (2 n_quantities, n_traces, n_parameters)."""
        ends = self.x[self.ends()].reshape(2, len(self.fits.likelihoods), -1, self.x.shape[1])
        return np.concatenate(ends.swapaxes(1, 2))

    def smooth(self, limits: Array) -> None:
        """Add limits, (n_profiles, 2) or NaN, and midpoints of neighbours far apart in drawings."""
        profile, side = np.nonzero(np.isfinite(limits))
        values = limits[profile, side]
        below = (self.profile == profile[:, None]) & (self.values < values[:, None])
        left = self.ends()[0, profile] + np.sum(below, axis=1) - 1
        new = self.values[left + 1] != values
        self._add(left[new], values[new])
        self._deepen(np.flatnonzero(np.isin(self.values, values[new])))
        for _ in range(_MOST_HALVINGS):
            roots = np.sqrt(np.clip(self.increases, 0.0, HIGHEST))
            left = np.flatnonzero(
                (np.abs(np.diff(roots)) > _ROOT_STEP) & (np.diff(self.profile) == 0)
            )
            self._add(left, 0.5 * (self.values[left] + self.values[left + 1]))

    def _deepen(self, limits: IntArray) -> None:
        """Fit limits above the threshold from the ends of all profiles, and their neighbours."""
        profile = self.profile[limits]
        missed = self.increases[limits] > levels.GAP * self.fits.threshold[profile]
        limits, profile = limits[missed], profile[missed]
        if not len(limits):
            return
        starts = self.extremes()[:, self.fits.trace[profile]]
        increases, x = self.fits.from_each(profile, self.values[limits], starts, CLOSE)
        self.increases[limits], self.x[limits] = np.min(increases, axis=0), x
        self.from_neighbours(np.isin(np.arange(len(self.values)), limits))

    def _add(self, left: IntArray, values: Array) -> None:
        """Insert points after given ones, each with the lower of the fits from both neighbours."""
        if not len(left):
            return
        profile, right = self.profile[left], left + 1
        increases, x = self.fits.from_each(profile, values, self.x[np.stack((left, right))], CLOSE)
        self.profile = np.insert(self.profile, right, profile)
        self.values = np.insert(self.values, right, values)
        self._optimum = np.insert(self._optimum, right, False)
        self.increases = np.insert(self.increases, right, np.min(increases, axis=0))
        self.x = np.insert(self.x, right, x, axis=0)


def keep_lower(
    increases: Array, x: Array, point: IntArray, fitted_increases: Array, fitted: Array
) -> BoolArray:
    """Keep lower fits of points, one or more each, in place; return which improved much."""
    news = np.zeros(len(increases), dtype=bool)
    for at, increase, parameters in zip(
        point.tolist(), fitted_increases.tolist(), fitted, strict=True
    ):
        before = increases[at]
        if increase < before:
            news[at] |= increase < before - _LEAST_IMPROVEMENT * (1 + abs(increase))
            increases[at], x[at] = increase, parameters
    return news


# Points near the best fit, in standard deviations, that every profile has.
_NEAR_OPTIMUM = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_EVENLY = 35
# Points closer to the optimum than this are left out.
_LEAST_GAP_OF_POINTS = 1e-9
_ROOT_ERROR = 1e-5


@dataclass(frozen=True)
class Profile:
    """A profile and its confidence limits, as logarithms of the quantity."""

    log_values: Array
    """Ascending values, (n_points,)."""
    increases: Array
    """Increase of chi^2 at each, (n_points,)."""
    best: float
    """Value at the optimum."""
    low: float | None
    """Lower confidence limit; None where the trace sets none."""
    high: float | None
    """Upper confidence limit, likewise."""
    lowest: Array
    """Log-parameters of the lowest increase, negative if the optimum was missed."""
    gaps: tuple[tuple[float, float], ...] = ()
    """Stretches between the limits in which the profile is above the threshold."""
    certainty: float | None = None
    """Increase that a limit takes at an end of the range, if an end is above the threshold and yet
    has no limit for want of it; else None."""
    slowest_s: float | None = None
    """Relaxation time of a branch of the best fit that denies limits, as it should be within the
    trace."""


def compute_profiles(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], *, smooth: bool = True
) -> list[list[Profile]]:
    """Compute profiles and limits by trace and quantity, with points for a drawing if `smooth`."""
    by_trace: dict[int, list[Profile]] = {}
    count = len(quantities)
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        fits = ConstrainedFits([likelihoods[index] for index in group], quantities)
        profiles = _profiles(fits, smooth=smooth)
        for place, index in enumerate(group.tolist()):
            by_trace[index] = profiles[place * count : (place + 1) * count]
    return [by_trace[index] for index in range(len(likelihoods))]


def _profiles(fits: ConstrainedFits, *, smooth: bool) -> list[Profile]:
    grids = [
        _grid_of(likelihood, quantity)
        for likelihood in fits.likelihoods
        for quantity in fits.quantities
    ]
    points = Points(fits, grids)
    points.from_optimum()
    points.from_neighbours()
    limits = _find_crossings(points).T
    if smooth:
        points.smooth(limits)
    profiles = []
    for index, ends in enumerate(limits.tolist()):
        in_profile = points.profile == index
        values, increases, x = (
            points.values[in_profile],
            points.increases[in_profile],
            points.x[in_profile],
        )
        gaps = find_gaps(values, increases, float(fits.threshold[index]))
        lowest = x[int(np.argmin(increases))]
        short = (increases[[0, -1]] > fits.threshold[index]) & np.isnan(ends)
        certainty = float(fits.certainty[index]) if np.any(short) else None
        best = float(fits.at_best[index])
        slowest_s = fits.slowest(index)
        if np.min(increases[values != best], initial=np.inf) <= fits.threshold[index]:
            slowest_s = None
        problem = fits.likelihoods[fits.trace[index]].problem
        quantity = fits.quantities[index % len(fits.quantities)]
        made = values[quantity.at_end(x, problem.low, problem.high, values > best)]
        low, high = (None if np.isnan(end) or end in made else end for end in ends)
        if slowest_s is not None:
            low, high, gaps, certainty = None, None, (), None
        profiles.append(
            Profile(values, increases, best, low, high, lowest, gaps, certainty, slowest_s)
        )
    return profiles


def _grid_of(likelihood: Likelihood, quantity: Quantity) -> Array:
    """Return ascending values over a quantity's whole range, denser near the optimum."""
    low, high = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start = quantity.log(likelihood.best)
    near = start + likelihood.deviation(quantity) * _NEAR_OPTIMUM
    others = np.concatenate((near[(near > low) & (near < high)], np.linspace(low, high, _EVENLY)))
    # Rounding must not make two points of an optimum that lies at an end.
    return np.unique(np.append(others[np.abs(others - start) > _LEAST_GAP_OF_POINTS], start))


def _find_crossings(points: Points) -> Array:
    """Find the limits, where profiles cross the threshold, (2, n_profiles); NaN without limit."""
    fits, ends = points.fits, points.ends()
    crossed = np.full(ends.shape, np.nan)
    end, profile = np.nonzero(points.increases[ends] > fits.certainty)
    while len(profile):
        below = np.flatnonzero(points.increases < fits.threshold[points.profile])
        of_below = points.profile[below]
        first, last = (
            np.searchsorted(of_below, profile),
            np.searchsorted(of_below, profile, "right") - 1,
        )
        inside = below[np.where(end == 0, first, last)]
        outside = np.where(end == 0, inside - 1, inside + 1)
        both = np.stack((inside, outside))
        values, increases, x = points.values[both], points.increases[both], points.x[both]
        elsewhere = points.extremes()[:, fits.trace[profile]]
        limits = crossings(fits, profile, values, increases, x, elsewhere)
        crossed[end, profile] = limits
        points.increases[both], points.x[both] = increases, x
        # Where the outer point has come below the threshold, the next bracket is further out.
        on = np.isnan(limits) & (outside != ends[end, profile])
        end, profile = end[on], profile[on]
    return crossed


# Most fits for a crossing, and the width of an interval in which a profile jumps.
_MOST_FITS_OF_CROSSING, _WIDTH_OF_JUMP = 40, 1e-7


class _Brackets:
    """Inner and outer ends of n crossings: values, excesses of the root of chi^2, nearest fits.

    Inner ends are below the threshold, (2, n), and outer ones above.
    """

    def __init__(self, threshold: Array, values: Array, increases: Array, x: Array) -> None:
        self.threshold, self._root_threshold = threshold, np.sqrt(threshold)
        self.values, self.x = values.copy(), x.copy()
        every = np.arange(len(threshold))
        self.excess = np.stack([self.excess_of(of_end, every) for of_end in increases])
        self._moved = np.full(len(threshold), -1)

    def excess_of(self, increases: Array, which: IntArray) -> Array:
        """Return roots of increases of chi^2 minus that of the threshold, (n,)."""
        return np.sqrt(np.maximum(increases, 0.0)) - self._root_threshold[which]

    def width(self, which: IntArray) -> Array:
        """Return the distances between both ends, (n,)."""
        return np.abs(self.values[1, which] - self.values[0, which])

    def between(self, which: IntArray) -> tuple[Array, Array]:
        """Return values where excesses, joined by lines, vanish, and parameters there."""
        share = self.excess[0, which] / (self.excess[0, which] - self.excess[1, which])
        tried = self.values[0, which] + share * (self.values[1, which] - self.values[0, which])
        return tried, self.x[0, which] + share[:, None] * (self.x[1, which] - self.x[0, which])

    def move(self, which: IntArray, tried: Array, over: Array, fitted: Array) -> None:
        """Move an end to tried values, by the Illinois rule.

        The excess of an end that stays a second time is halved, so that the end moves, too.
        """
        side = (over > 0).astype(np.int64)
        self.values[side, which], self.excess[side, which] = tried, over
        self.x[side, which] = fitted
        again = self._moved[which] == side
        self.excess[1 - side[again], which[again]] *= 0.5
        self._moved[which] = side


def crossings(
    fits: ConstrainedFits,
    profile: IntArray,
    values: Array,
    increases: Array,
    x: Array,
    elsewhere: Array,
) -> Array:
    """Find the logarithms of quantities at which the increase of chi^2 equals the threshold, (n,).

    1. A value is tried between an inner end, below the threshold, and an outer, above it.
    2. It is fitted from both ends and between: they may lie in different basins, of which the
       deeper one counts. At first the best fit from elsewhere is one more start.
    3. Where the basin is deeper than that of the outer end, the outer end is fitted from there.
    4. One end of each bracket moves to the value, until the threshold or a jump is met.

    Parameters
    ----------
    profile
        Profile of each crossing, (n,).
    values, increases, x
        Logarithms, increases of chi^2 and fits of both ends, (2, n) or (2, n, n_parameters). Lower
        fits that are found at outer ends replace theirs, in place.
    elsewhere
        Starts that may lead to deeper basins, (n_starts, n, n_parameters).

    Returns
    -------
    Array
        NaN where a deeper basin is below the threshold at the outer end: the crossing is further
        out.
    """
    brackets = _Brackets(fits.threshold[profile], values, increases, x)
    crossed, left = values[1].copy(), np.arange(len(profile))
    for trial in range(_MOST_FITS_OF_CROSSING):
        if not len(left):
            break
        tried, between = brackets.between(left)
        starts = np.concatenate((between[None], brackets.x[:, left]))
        if not trial:
            _, deepest = fits.from_each(profile, tried, elsewhere, FAIR)
            starts = np.concatenate((starts, deepest[None]))
        reached, fitted = fits.from_each(profile[left], tried, starts, FINE)
        over = brackets.excess_of(np.min(reached, axis=0), left)
        missed = brackets.excess_of(reached[2], left) > over + _ROOT_ERROR
        if np.any(missed):
            outer = left[missed]
            beyond = fits.at(profile[outer], values[1, outer], fitted[missed], FINE)
            keep_lower(increases[1], x[1], outer, *beyond)
        void = increases[1, left] < brackets.threshold[left]
        crossed[left] = np.where(void, np.nan, tried)
        brackets.move(left, tried, over, fitted)
        # Where a deeper basin begins, the increase may jump past the threshold.
        apart = brackets.width(left) > _WIDTH_OF_JUMP
        left = left[(np.abs(over) > _ROOT_ERROR) & apart & ~void]
    return crossed


def find_gaps(
    log_values: Array, increases: Array, threshold: float
) -> tuple[tuple[float, float], ...]:
    """Find stretches above the threshold, with ends interpolated in the root of the increase."""
    roots = np.sqrt(np.maximum(increases, 0.0))
    gaps = []
    for start, end in pairwise(np.flatnonzero(increases < threshold).tolist()):
        if end > start + 1 and increases[start + 1 : end].max() > levels.GAP * threshold:
            # Places for `np.interp` ascend from inside to outside.
            sides = [start, start + 1], [end, end - 1]
            first, last = (np.interp(np.sqrt(threshold), roots[of], log_values[of]) for of in sides)
            gaps.append((float(first), float(last)))
    return tuple(gaps)
