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

To hold a quantity at a value, one member of it, a parameter, is eliminated: it follows from the
others and the value (generalized reduced gradients [4]_). The dominant member is eliminated, chosen
anew at every step among those that are not at a bound: any other would move far in a small step. A
stiff penalty residual instead would be violated, the more the better the trace determines the
quantity.

Crossings are found by the Illinois rule [3]_, applied to the square root of the increase of chi^2,
which is nearly linear in the quantity's logarithm: a few fits suffice.

References
----------
.. [1] D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37 (1988), 87-94.
.. [2] A. Raue et al., Bioinformatics 25 (2009), 1923-1929.
.. [3] M. Dowell and P. Jarratt, BIT 11 (1971), 168-174.
.. [4] J. Abadie and J. Carpentier, in R. Fletcher (ed.), Optimization, Academic Press, 1969, 37-47.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import plain, with_limits, within_limits
from biogrip.fit.least_squares import FAIR, FINE, LocalFits, Minima, Normal, alike
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
        words, unit = self._limits_in_words(), f" {self.quantity.unit}".rstrip()
        if self.gaps:
            ends = (end for gap in self.gaps for end in gap)
            gaps = within_limits(self.value, self.low or 0.0, self.high or 0.0, *ends)[3:]
            but = " and ".join(map(" to ".join, zip(gaps[::2], gaps[1::2], strict=True)))
            words += f", except {but}{unit}"
        if self.quantity.provided and self.is_bounded:
            words += f", provided {self.quantity.provided}"
        return words

    def _limits_in_words(self) -> str:
        low, high, unit = self.low, self.high, f" {self.quantity.unit}".rstrip()
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


# E-folds from a bound at which a member counts as free, and by which rounding may exceed it.
_FREE_OF_BOUND, _BEYOND_BOUND = 1e-9, 1e-7
# Factor on the weight of members at a bound in the choice of the eliminated one.
_UNWILLING = 1e-9
_LEAST_SLOPE = 1e-200


class QuantityConstraint:
    """A constraint on each of n fits, which holds one quantity at a given value.

    Each fit has the index of its quantity, (n,), and the logarithm of its value, within its range.
    Bounds are (n, n_parameters). Branches must relax within a time for quantities that require it;
    the penalty is in standard deviations of the noise, over which the fits' unit is (n,).
    """

    def __init__(
        self,
        quantities: Sequence[Quantity],
        which: IntArray,
        targets: Array,
        low: Array,
        high: Array,
        longest_s: float,
        unit: Array,
    ) -> None:
        self._unit = unit[:, None]
        self._which, self._targets = which, targets
        self._low, self._high = low, high
        parameters = low.shape[1]
        self._powers = np.zeros((len(quantities), parameters))
        most = max(len(quantity.penalties) for quantity in quantities)
        self._forms = np.zeros((len(quantities), most, parameters))
        self._allowed, self._stiffness = np.zeros((2, len(quantities), most))
        for index, quantity in enumerate(quantities):
            self._powers[index, list(quantity.members)] = quantity.sign
            for row, penalty in enumerate(quantity.penalties):
                self._forms[index, row] = penalty.form(parameters)
                self._allowed[index, row] = penalty.allowed(longest_s)
                self._stiffness[index, row] = penalty.stiffness
        self._senses = np.array([float(quantity.sense) for quantity in quantities])
        self._most_members = max(len(quantity.members) for quantity in quantities)

    def started(self, x: Array) -> Array:
        """Move points, (n, n_parameters), onto the constraint."""
        everyone = np.arange(len(x))
        powers, sense = self._form(everyone)
        of_sums = np.logaddexp.reduce(np.where(powers != 0, sense * x, -np.inf), axis=1)[:, None]
        logs = np.where(sense == 0, np.sum(powers * x, axis=1)[:, None], sense * of_sums)
        by = self._targets[:, None] - logs
        first = np.cumsum(np.abs(powers), axis=1) * np.abs(powers) == 1
        moved = x + by * np.where(sense == 0, powers * first, powers)
        moved = np.clip(moved, self._low, self._high)
        eliminated = self._dominant(moved, everyone, self._slopes(moved, everyone))
        restored = self.restored(moved, everyone, eliminated)
        if np.any(np.isnan(restored)):
            raise ValueError("a quantity is to be held outside its range")
        return restored

    def added(self, normal: Normal, x: Array, fit: IntArray) -> Normal:
        """Return the normal equations with penalty residuals for branches that relax too late."""
        beyond, slopes = self._late(x, fit)
        if not slopes.size:
            return normal
        return replace(
            normal,
            square_sum=normal.square_sum + np.sum(beyond**2, axis=1),
            gradient=normal.gradient + np.sum(beyond[:, :, None] * slopes, axis=1),
            information=normal.information + slopes.swapaxes(1, 2) @ slopes,
        )

    def price(self, x: Array) -> Array:
        """Return the penalty on the sums of squares for branches that relax too late, (n,)."""
        return np.sum(self._late(x, np.arange(len(x)))[0] ** 2, axis=1)

    def eliminated(self, normal: Normal, x: Array, fit: IntArray) -> tuple[Normal, BoolArray]:
        """Eliminate one parameter; return reduced equations and its mask, (n, n_parameters)."""
        slopes = self._slopes(x, fit)
        basic = self._dominant(x, fit, slopes)
        # Minus the derivative of the eliminated parameter by each other one; 1 by itself.
        ratio = slopes / np.sum(slopes * basic, axis=1, keepdims=True)
        # Derivatives of all parameters by the others, none by the eliminated one.
        by_others = np.eye(x.shape[1]) - basic[:, :, None] * ratio[:, None, :]
        gradient = (normal.gradient[:, None] @ by_others)[:, 0]
        information = by_others.swapaxes(1, 2) @ normal.information @ by_others
        information += np.eye(x.shape[1]) * basic[:, :, None]
        return replace(normal, gradient=gradient, information=information), basic

    def restored(self, x: Array, fit: IntArray, eliminated: BoolArray) -> Array:
        """Move points, (n, n_parameters), onto the constraint; NaN where bounds forbid that."""
        x, basic, tried = x.copy(), eliminated, eliminated.copy()
        left = np.arange(len(x))
        for _ in range(self._most_members):
            value = self._followed(x[left], fit[left], basic)
            inside = np.clip(value, self._low[fit[left]], self._high[fit[left]])
            x[left] = np.where(basic, inside, x[left])
            reached = np.any(basic & (np.abs(value - inside) <= _BEYOND_BOUND), axis=1)
            left = left[~reached]
            if not len(left):
                return x
            # The eliminated member stays at its bound, and the next one is eliminated.
            slopes = self._slopes(x[left], fit[left])
            basic = self._dominant(x[left], fit[left], slopes, tried[left])
            tried[left] |= basic
        x[left] = np.nan
        return x

    def _dominant(
        self, x: Array, fit: IntArray, slopes: Array, tried: BoolArray | None = None
    ) -> BoolArray:
        """Mark the member to eliminate, none if all have been tried."""
        weight = np.abs(slopes)
        free = (x > self._low[fit] + _FREE_OF_BOUND) & (x < self._high[fit] - _FREE_OF_BOUND)
        weight = np.where(free, weight, _UNWILLING * weight)
        if tried is not None:
            weight = np.where(tried, 0.0, weight)
        chosen = np.argmax(weight, axis=1)[:, None] == np.arange(x.shape[1])
        return chosen & (weight > 0)

    def _late(self, x: Array, fit: IntArray) -> tuple[Array, Array]:
        """Return the residuals of hinges, (n, n_hinges), and their log-parameter derivatives."""
        which = self._which[fit]
        forms, stiffness = self._forms[which], self._stiffness[which] * self._unit[fit]
        beyond = np.sum(forms * x[:, None], axis=2) - self._allowed[which]
        late = beyond > 0
        slopes = stiffness[:, :, None] * forms * late[:, :, None]
        return np.where(late, stiffness * beyond, 0.0), slopes

    def _slopes(self, x: Array, fit: IntArray) -> Array:
        """Return the log-parameter derivatives of the quantities' logarithms on the constraint."""
        powers, sense = self._form(fit)
        shares = np.exp(np.minimum(sense * (x - self._targets[fit][:, None]), 0.0))
        return np.where(sense == 0, powers, np.maximum(shares, _LEAST_SLOPE) * (powers != 0))

    def _followed(self, x: Array, fit: IntArray, basic: BoolArray) -> Array:
        """Solve the constraints for the marked members; infinite where there is no solution."""
        powers, sense = self._form(fit)
        target = self._targets[fit][:, None]
        others = np.where(basic, 0.0, powers)
        of_product = (target - np.sum(others * x, axis=1, keepdims=True)) * powers
        taken = np.sum(np.abs(others) * np.exp(sense * (x - target)), axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            of_sum = target + sense * np.log1p(-np.minimum(taken, 1.0))
        return np.where(basic, np.where(sense == 0, of_product, of_sum), x)

    def _form(self, fit: IntArray) -> tuple[Array, Array]:
        """Return the powers of the members, (n, n_parameters), and each sum's sense, (n, 1)."""
        which = self._which[fit]
        return self._powers[which], self._senses[which][:, None]


CLOSE = 1e-7
"""Tolerance of fits that give chi^2 to 0.001; to the last digit takes three times as many steps."""


class ConstrainedFits:
    """Fits of several traces, whose problems are `alike`, with one of several quantities held.

    Each profile belongs to a trace and a quantity; those of the first trace come first. Of each
    there are the index of its `trace`, the optimum `best`, (n_profiles, n_parameters), the
    logarithm of the quantity `at_best`, and `threshold` and `certainty`, no less, as in
    `Likelihood`.
    """

    def __init__(self, likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> None:
        self.likelihoods, self.quantities = likelihoods, quantities
        problems = [likelihood.problem for likelihood in likelihoods]
        self.trace = np.repeat(np.arange(len(likelihoods)), len(quantities))
        self._optima = np.stack([likelihood.best for likelihood in likelihoods])
        self.best = self._optima[self.trace]
        self.at_best = np.array([q.log(x) for x in self._optima for q in quantities])
        settings = [(one.threshold, one.certainty, one.misfit, one.noise_sd) for one in likelihoods]
        threshold, certainty, self._misfit, self._noise_sd = np.array(settings).T
        self.threshold = threshold[self.trace]
        self.certainty = np.maximum(certainty, threshold)[self.trace]
        self._fits = LocalFits(problems)
        self._residuals = problems[0].residuals
        scale = np.array([problem.residuals.trace.scatter for problem in problems])
        self._unit = np.array([problem.residuals.noise_scale for problem in problems]) / scale
        # Ratio of chi^2 to the fits' sums of squares.
        self._ratio = (scale / self._noise_sd) ** 2

    def at(
        self, profile: IntArray, targets: Array, near: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Minimize chi^2 over all parameters with one quantity held at a value.

        A target is the logarithm at which the quantity of a profile is held, within its range,
        (n,). Starts near the fit, (n, n_parameters), are moved onto the constraint. Returns the
        increases of chi^2 over each trace's optimum, (n,), and the fitted log-parameters.
        """
        trace, which = np.divmod(profile, len(self.quantities))
        low, high = self._fits.low[trace], self._fits.high[trace]
        last_s = self._residuals.duration_s
        given = self.quantities, which, targets, low, high, last_s, self._unit[trace]
        constraint = QuantityConstraint(*given)
        minima = self._fits.fitted(near, trace, tolerance, constraint=constraint)
        price = constraint.price(minima.x) * self._ratio[trace]
        return self._increases(minima, trace) + price, minima.x

    def from_each(
        self, profile: IntArray, targets: Array, starts: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Fit as `at` does, each from several starts, (n_starts, n, n_parameters).

        Returns the increases from each start, (n_starts, n), and the log-parameters of the lowest,
        (n, n_parameters).
        """
        count, near = len(starts), np.concatenate(starts)
        increases, x = self.at(np.tile(profile, count), np.tile(targets, count), near, tolerance)
        increases = increases.reshape(count, -1)
        return increases, x.reshape(starts.shape)[np.argmin(increases, axis=0), range(len(profile))]

    def _increases(self, minima: Minima, trace: IntArray) -> Array:
        excess = minima.misfit**2 - self._misfit[trace] ** 2
        return self._residuals.samples * excess / self._noise_sd[trace] ** 2

    def slowest(self, profile: int) -> float | None:
        """Return the relaxation time in s of a branch of an optimum that is too slow, if any."""
        quantity = self.quantities[profile % len(self.quantities)]
        best, last_s = self.best[profile], self._residuals.duration_s
        times = [
            float(np.exp(penalty.form(len(best)) @ best))
            for penalty in quantity.penalties
            if penalty.before is None
        ]
        slowest = max(times, default=0.0)
        return slowest if slowest > last_s else None


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
        limits, fitted = _crossings(points, profile, np.stack((inside, outside)))
        crossed[end, profile], at_crossings[end, profile] = limits, fitted
        # Where the outer point has come below the threshold, the next bracket is further out.
        on = np.isnan(limits) & (outside != ends[end, profile])
        end, profile = end[on], profile[on]
    return crossed, at_crossings


# Most fits for a crossing, and the width of an interval in which a profile jumps.
_MOST_FITS_OF_CROSSING, _WIDTH_OF_JUMP = 40, 1e-7


def _crossings(points: Points, profile: IntArray, both: IntArray) -> tuple[Array, Array]:
    """Find the logarithms of quantities at which the increase of chi^2 equals the threshold, (n,).

    1. A value is tried between an inner end, below the threshold, and an outer, above it.
    2. It is fitted from both ends and between: they may lie in different basins, of which the
       deeper one counts. At first the best fit from the ends of all profiles is one more start.
    3. Where the basin is deeper than that of the outer end, the outer end is fitted from there.
    4. One end of each bracket moves to the value, until the threshold or a jump is met.

    Given are the profile of each crossing, (n,), and its inner and outer point, (2, n). Returns the
    crossings, NaN where a deeper basin is below the threshold at the outer end, as the crossing is
    further out; and their fits, (n, n_parameters).
    """
    fits, outer_point = points.fits, both[1]
    values, increases, x = points.values[both], points.increases[both], points.x[both]
    elsewhere = points.extremes()[:, fits.trace[profile]]
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
            keep_lower(points.increases, points.x, outer_point[outer], *beyond)
        void = points.increases[outer_point[left]] < threshold[left]
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
