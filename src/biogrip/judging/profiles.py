"""Profile likelihoods, limits, and verdicts: determined, bounded on one side, or not determined.

A profile is the minimum of chi^2 over all parameters against one quantity [1]_, [2]_. It has a
limit on a side if it exceeds `Likelihood.certainty` (99.9 %) at that end of the search range; the
limit is where it crosses `Likelihood.threshold` (95 %, or the confidence asked for). The verdict is
which of the two limits there are; `Finding.words` has the words of each.

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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import plain, with_limits, within_limits
from biogrip.fit.least_squares import FAIR, FINE, alike
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits
from biogrip.judging.likelihood import Likelihood, Quantity, find_combinations

DETERMINED = "determined"
BOUNDED_BELOW = "bounded below"
BOUNDED_ABOVE = "bounded above"
NOT_DETERMINED = "not determined"
FIT_REJECTED = "fit rejected"
"""Verdict on every quantity of a fit that is rejected."""


def verdict_of(low: float | None, high: float | None) -> str:
    """Return the verdict on a quantity with these limits."""
    if low is None:
        return NOT_DETERMINED if high is None else BOUNDED_ABOVE
    return BOUNDED_BELOW if high is None else DETERMINED


@dataclass(frozen=True)
class Finding:
    """A quantity, the profile of its logarithm, its limits, and the verdict on it."""

    quantity: Quantity
    log_values: Array
    """Ascending logarithms, (n_points,)."""
    increases: Array
    """Increase of chi^2 at each, (n_points,)."""
    log_best: float
    """Logarithm at the optimum."""
    log_low: float | None
    """Lower confidence limit; None where the trace sets none."""
    log_high: float | None
    """Upper confidence limit, likewise."""
    lowest: Array
    """Log-parameters of the lowest increase, negative if the optimum was missed."""
    deviation: float
    """Standard deviation of its logarithm to first order, see `Likelihood.deviation`."""
    log_gaps: tuple[tuple[float, float], ...] = ()
    """Stretches between the limits in which the profile is above the threshold."""
    slowest_s: float | None = None
    """Relaxation time of a branch of the best fit that denies limits, as it should be within the
    trace."""

    @property
    def verdict(self) -> str:
        """Verdict: determined, bounded below or above, or not determined."""
        return verdict_of(self.log_low, self.log_high)

    @property
    def value(self) -> float:
        """Best estimate in SI units, meaningful only if the quantity is determined."""
        return math.exp(self.log_best)

    @property
    def low(self) -> float | None:
        """Lower confidence limit in SI units."""
        return None if self.log_low is None else math.exp(self.log_low)

    @property
    def high(self) -> float | None:
        """Upper confidence limit in SI units."""
        return None if self.log_high is None else math.exp(self.log_high)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Stretches between the limits that are excluded, in SI units."""
        return [(math.exp(start), math.exp(end)) for start, end in self.log_gaps]

    @property
    def is_bounded(self) -> bool:
        """True if the trace bounds the quantity on at least one side."""
        return self.verdict != NOT_DETERMINED

    @property
    def is_wide(self) -> bool:
        """True if its two limits tell little more than an order of magnitude: see `WIDE`."""
        low, high = self.low, self.high
        return low is not None and high is not None and high > levels.WIDE**2 * low

    def allows(self, log_parameters: Array) -> bool:
        """Return True if parameters, (n_parameters,), lie within the limits; NaN does."""
        value = self.quantity.log(log_parameters)
        low, high = self.log_low, self.log_high
        beyond = (low is not None and value < low) or (high is not None and value > high)
        return not (beyond or any(start < value < end for start, end in self.log_gaps))

    def words(self) -> str:
        """Return the verdict in words, e.g. ``determined: 34.1 N/m (31.2 to 37.3)``."""
        words, unit = self._limits_in_words(), self._unit
        if self.gaps:
            ends = (end for gap in self.gaps for end in gap)
            gaps = within_limits(self.value, self.low or 0.0, self.high or 0.0, *ends)[3:]
            but = " and ".join(map(" to ".join, zip(gaps[::2], gaps[1::2], strict=True)))
            words += f", except {but}{unit}"
        if self.quantity.provided and self.is_bounded:
            words += f", provided {self.quantity.provided}"
        return words

    def _limits_in_words(self) -> str:
        low, high, unit = self.low, self.high, self._unit
        if low is not None and high is not None:
            decades = plain(math.log10(high / low), 2)
            how = f" only to {decades} decades" if self.is_wide else ""
            return f"determined{how}: {with_limits(self.value, low, high, self.quantity.unit)}"
        if low is not None:
            return f"only bounded below: at least {plain(low, 2)}{unit}"
        if high is not None:
            return f"only bounded above: at most {plain(high, 2)}{unit}"
        if self.slowest_s is not None:
            slowest = f"a branch of the best fit relaxes in {plain(self.slowest_s, 2)} s,"
            return f"not stated: {slowest} longer than the trace lasts"
        return "not determined: the trace sets no limit within the search range"

    @property
    def _unit(self) -> str:
        return f" {self.quantity.unit}" if self.quantity.unit else ""


@dataclass(frozen=True)
class Trade:
    """Parameters of which only a combination is determined."""

    members: tuple[str, ...]
    """Names of parameters that trade against each other."""
    finding: Finding
    """The combination that is determined."""

    def words(self) -> str:
        """Return the trade as a sentence."""
        names = " and ".join(self.members)
        what = self.finding.words().partition(": ")[2]
        return (
            f"{names} trade against each other; determined is {self.finding.quantity.label}: {what}"
        )


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

    def from_neighbours(self) -> None:
        """Fit points from their neighbours' fits as long as these improve."""
        # Optima, and places beyond the ends, belong to no profile here: they are not fitted.
        to_fit = np.append(np.where(self._optimum, -1, self.profile), -1)
        news = np.full(len(self.values), True)
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


def keep_lower(
    increases: Array, x: Array, point: IntArray, fitted_increases: Array, fitted: Array
) -> BoolArray:
    """Keep lower fits of points, one or more each, in place; return which improved much."""
    before = increases.copy()
    # Of several fits of a point the lowest comes last, and stays.
    order = np.argsort(-fitted_increases, kind="stable")
    lower = order[fitted_increases[order] < before[point[order]]]
    increases[point[lower]], x[point[lower]] = fitted_increases[lower], fitted[lower]
    return increases < before - _LEAST_IMPROVEMENT * (1 + np.abs(increases))


# Points near the best fit, in standard deviations, that every profile has.
_NEAR_OPTIMUM = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_EVENLY = 35
# Points closer to the optimum than this are left out.
_LEAST_GAP_OF_POINTS = 1e-9
_ROOT_ERROR = 1e-5


def compute_findings(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> list[list[Finding]]:
    """Profile quantities in each of several traces, and reach a verdict on each of them."""
    by_trace: dict[int, list[Finding]] = {}
    count = len(quantities)
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        fits = ConstrainedFits([likelihoods[index] for index in group], quantities)
        findings = _findings(fits)
        for place, index in enumerate(group.tolist()):
            by_trace[index] = findings[place * count : (place + 1) * count]
    return [by_trace[index] for index in range(len(likelihoods))]


def _findings(fits: ConstrainedFits) -> list[Finding]:
    pairs = [(one, quantity) for one in fits.likelihoods for quantity in fits.quantities]
    deviations = [likelihood.deviation(quantity) for likelihood, quantity in pairs]
    of_grids = zip(pairs, deviations, strict=True)
    points = Points(fits, [_grid_of(*pair, deviation) for pair, deviation in of_grids])
    points.from_optimum()
    points.from_neighbours()
    limits, at_limits = _find_crossings(points)
    findings = []
    for index, (likelihood, quantity) in enumerate(pairs):
        of = points.profile == index
        values, increases, x = points.values[of], points.increases[of], points.x[of]
        best, threshold = float(fits.at_best[index]), float(fits.threshold[index])
        slowest_s, ends = fits.slowest(index), limits[:, index]
        if np.min(increases[values != best], initial=np.inf) <= threshold:
            slowest_s = None
        # Limits that the ends of search ranges make are none.
        ranges, above = (likelihood.problem.low, likelihood.problem.high), np.array([False, True])
        ends = np.where(quantity.at_end(at_limits[:, index], *ranges, above), np.nan, ends)
        told = ends[np.isfinite(ends)] if slowest_s is None else ends[:0]
        low, high = (float(end) if end in told else None for end in ends)
        lowest, increases = x[int(np.argmin(increases))], np.append(increases, threshold + 0 * told)
        values = np.append(values, told)
        order = np.argsort(values, kind="stable")
        shown = quantity, values[order], increases[order], best, low, high, lowest
        gaps = find_gaps(*shown[1:3], threshold) if slowest_s is None else ()
        findings.append(Finding(*shown, deviations[index], gaps, slowest_s))
    return findings


def _grid_of(likelihood: Likelihood, quantity: Quantity, deviation: float) -> Array:
    """Return ascending values over a quantity's whole range, denser near the optimum."""
    low, high = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start = quantity.log(likelihood.best)
    near = start + deviation * _NEAR_OPTIMUM
    others = np.concatenate((near[(near > low) & (near < high)], np.linspace(low, high, _EVENLY)))
    # Rounding must not make two points of an optimum that lies at an end.
    return np.unique(np.append(others[np.abs(others - start) > _LEAST_GAP_OF_POINTS], start))


def _find_crossings(points: Points) -> tuple[Array, Array]:
    """Find the limits, where profiles cross the threshold, (2, n_profiles); NaN without limit.

    Returns their fits, too, (2, n_profiles, n_parameters).
    """
    fits, ends = points.fits, points.ends()
    crossed, at_crossings = np.full(ends.shape, np.nan), fits.best[np.zeros_like(ends)]
    end, profile = np.nonzero(points.increases[ends] > fits.certainty)
    while len(profile):
        below = np.flatnonzero(points.increases < fits.threshold[points.profile])
        of_below = points.profile[below]
        first = np.searchsorted(of_below, profile)
        last = np.searchsorted(of_below, profile, "right") - 1
        inside = below[np.where(end == 0, first, last)]
        outside = np.where(end == 0, inside - 1, inside + 1)
        both = np.stack((inside, outside))
        values, increases, x = points.values[both], points.increases[both], points.x[both]
        elsewhere = points.extremes()[:, fits.trace[profile]]
        limits, fitted = crossings(fits, profile, values, increases, x, elsewhere)
        crossed[end, profile], at_crossings[end, profile] = limits, fitted
        points.increases[both], points.x[both] = increases, x
        # Where the outer point has come below the threshold, the next bracket is further out.
        on = np.isnan(limits) & (outside != ends[end, profile])
        end, profile = end[on], profile[on]
    return crossed, at_crossings


# Most fits for a crossing, and the width of an interval in which a profile jumps.
_MOST_FITS_OF_CROSSING, _WIDTH_OF_JUMP = 40, 1e-7


def crossings(
    fits: ConstrainedFits,
    profile: IntArray,
    values: Array,
    increases: Array,
    x: Array,
    elsewhere: Array,
) -> tuple[Array, Array]:
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
    tuple[Array, Array]
        The crossings, NaN where a deeper basin is below the threshold at the outer end, as the
        crossing is further out; and their fits, (n, n_parameters).
    """
    threshold = fits.threshold[profile]
    ends, ends_x, excess = values.copy(), x.copy(), excess_of(increases, threshold)
    crossed, at_crossings, left = values[1].copy(), x[1].copy(), np.arange(len(profile))
    moved = np.full(len(profile), -1)
    for trial in range(_MOST_FITS_OF_CROSSING):
        if not len(left):
            break
        share = excess[0, left] / (excess[0, left] - excess[1, left])
        tried = ends[0, left] + share * (ends[1, left] - ends[0, left])
        inner_x, outer_x = ends_x[:, left]
        starts = np.stack((inner_x + share[:, None] * (outer_x - inner_x), inner_x, outer_x))
        if not trial:
            _, deepest = fits.from_each(profile, tried, elsewhere, FAIR)
            starts = np.concatenate((starts, deepest[None]))
        reached, fitted = fits.from_each(profile[left], tried, starts, FINE)
        over = excess_of(np.min(reached, axis=0), threshold[left])
        missed = excess_of(reached[2], threshold[left]) > over + _ROOT_ERROR
        if np.any(missed):
            outer = left[missed]
            beyond = fits.at(profile[outer], values[1, outer], fitted[missed], FINE)
            keep_lower(increases[1], x[1], outer, *beyond)
        void = increases[1, left] < threshold[left]
        crossed[left], at_crossings[left] = np.where(void, np.nan, tried), fitted
        side = (over > 0).astype(np.int64)
        ends[side, left], ends_x[side, left], excess[side, left] = tried, fitted, over
        # The excess of an end that stays a second time is halved, so that the end moves, too.
        again = moved[left] == side
        excess[1 - side[again], left[again]] *= 0.5
        moved[left] = side
        # Where a deeper basin begins, the increase may jump past the threshold.
        apart = np.abs(ends[1, left] - ends[0, left]) > _WIDTH_OF_JUMP
        left = left[(np.abs(over) > _ROOT_ERROR) & apart & ~void]
    return crossed, at_crossings


def excess_of(increases: Array, threshold: Array) -> Array:
    """Return roots of increases of chi^2 minus that of the threshold, (..., n)."""
    return np.sqrt(np.maximum(increases, 0.0)) - np.sqrt(threshold)


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


def find_trade_offs(likelihood: Likelihood, findings: Sequence[Finding]) -> list[Trade]:
    """Find determined combinations of undetermined parameters.

    Combinations among the findings come first. Of other pairs, the combination known best to first
    order is profiled, if it is worth a look.
    """
    model, trades = likelihood.problem.residuals.model, list[tuple[tuple[int, ...], Finding]]()
    left = [
        finding.quantity.members[0]
        for finding in findings
        if len(finding.quantity.members) == 1 and finding.verdict != DETERMINED
    ]
    for finding in findings:
        members = tuple(index for index in finding.quantity.members if index in left)
        if len(members) > 1:
            trades.append((members, finding))
            left = [index for index in left if index not in members]
    for pair in combinations(left, 2):
        candidates = find_combinations(model, list(pair))
        best = min(candidates, key=likelihood.deviation, default=None)
        if best is not None and likelihood.deviation(best) < levels.WORTH_A_PROFILE:
            ((finding,),) = compute_findings([likelihood], [best])
            trades.append((pair, finding))
    return [
        Trade(tuple(model.parameters[index].name for index in members), finding)
        for members, finding in trades
        if finding.verdict == DETERMINED
    ]
