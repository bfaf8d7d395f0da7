"""Profile likelihood: how well a trace can still be fitted with one quantity held.

The rise of the sum of squares over its minimum, in units of the noise's
variance, is the rise of chi^2. A quantity has a confidence limit where the rise
is the threshold, and what is returned is the value at which it was found to be.

References
----------
.. [1] D. J. Venzon and S. H. Moolgavkar, A method for computing profile-likelihood-based
   confidence intervals, Applied Statistics 37 (1988), 87-94.
.. [2] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis and Its Applications, Wiley,
   1988: profiles and the F threshold where the noise is estimated.
.. [3] A. Raue et al., Structural and practical identifiability analysis of partially observed
   dynamical models by exploiting the profile likelihood, Bioinformatics 25 (2009), 1923-1929.
.. [4] M. Dowell and P. Jarratt, A modified regula falsi method for computing the root of an
   equation, BIT 11 (1971), 168-174: the Illinois rule.
"""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.identifiability.confidence_set import gaps_of
from biogrip.identifiability.held_fit import held_fit
from biogrip.identifiability.quantities import Quantity
from biogrip.identifiability.smooth import Points, smoothed
from biogrip.identify.local_fit import FAIR, FINE, Objective
from biogrip.identify.problem import Problem

# Steps away from the best fit, in standard deviations, that every profile has.
_NEAR = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_POINTS = 35
CERTAIN = 0.999
"""Confidence with which a profile has to rise, at an end of the range, for that side to close."""

MISSED = 0.05
"""Chi^2 that the prior, by which optima are chosen where the trace says nothing, may cost.

What is deeper than an optimum by more says that it was not the global one.
"""
_MOST_DOUBLINGS = 12
_MOST_HALVINGS = 60
# A guess in a bracket keeps away from its ends, so that a jump is soon enclosed.
_LEAST_SHARE = 1e-3


@dataclass(frozen=True)
class _Accuracy:
    """Of a fit, as the share of its cost that ends it; of a limit, as a share of the threshold."""

    fit: float
    limit: float


_EXACT = _Accuracy(FINE, 1e-5)
# Chi^2 to 0.004, and limits to a thousandth of a standard deviation or two: enough to count.
_FAST = _Accuracy(FAIR, 1e-3)


@dataclass(frozen=True)
class Likelihood:
    """What the profiles of one trace are measured against.

    Parameters
    ----------
    problem
        The trace and the model.
    best : (n_parameters,)
        Log-parameters of the global optimum.
    misfit_rad
        Misfit there.
    noise_rad
        Standard deviation of the noise, known or estimated from the residual.
    threshold
        Rise of chi^2 at the confidence limits: chi-squared with one degree of
        freedom where the noise is known, F where it, or its colour, is estimated. It is that of an
        interval with two ends: a limit that stands alone is one of these ends, and
        holds with more than the confidence.
    certainty
        Rise that a profile must have reached at the end of the range to be closed
        there; the same at `CERTAIN`. A profile that levels off between the two has
        a confidence limit by the luck of the noise alone.
    """

    problem: Problem
    best: Array
    misfit_rad: float
    noise_rad: float
    threshold: float
    certainty: float

    def rise(self, misfit_rad: float) -> float:
        """Rise of chi^2 over the optimum."""
        excess = misfit_rad**2 - self.misfit_rad**2
        return float(self.problem.residuals.samples * excess / self.noise_rad**2)

    def deviation(self, quantity: Quantity) -> float:
        """Standard deviation of a quantity's logarithm to first order, some e-folds at most.

        Every parameter counts as known to an e-fold beforehand: beyond that a
        straight line says nothing of it, nor of what it does to others. Unlike a
        `bound`, this has no threshold that a parameter's information may pass.
        """
        _, sensitivity = self.problem.residuals.condensed(self.best)
        relative = sensitivity / self.noise_rad
        slope = quantity.gradient(self.best)
        information = relative @ relative.T + np.eye(len(slope))
        return float(np.sqrt(slope @ np.linalg.solve(information, slope)))


@dataclass(frozen=True)
class Profile:
    """A profile and its confidence limits, as logarithms of the quantity.

    Parameters
    ----------
    log_values, rises : (n_points,)
        Ascending values, and the rise of chi^2 at each.
    best
        Value at the optimum.
    low, high
        Confidence limits; None where the trace does not close the profile.
    lowest : (n_parameters,)
        Log-parameters at the lowest rise, which is below zero if the optimum was missed.
    gaps
        Where, between points within confidence, the profile is above the threshold.
    """

    log_values: Array
    rises: Array
    best: float
    low: float | None
    high: float | None
    lowest: Array
    gaps: tuple[tuple[float, float], ...] = ()


def likelihood_of(
    problem: Problem,
    best: Array,
    misfit_rad: float,
    *,
    confidence: float,
    noise_rad: float | None = None,
) -> Likelihood:
    """Set the scale of a trace's profiles.

    Parameters
    ----------
    problem, best, misfit_rad
        As of `Likelihood`.
    confidence
        Of the limits, e.g. 0.95.
    noise_rad
        Standard deviation of the noise if it is known.
    """
    levels = (confidence, CERTAIN)
    if noise_rad is not None:
        threshold, certainty = (NormalDist().inv_cdf((1 + level) / 2) ** 2 for level in levels)
    else:
        left = problem.residuals.free - len(best)
        noise_rad = misfit_rad * float(np.sqrt(problem.residuals.samples / left))
        from scipy.special import fdtri

        threshold, certainty = fdtri(1, min(left, problem.residuals.freedom), levels)
    return Likelihood(problem, best, misfit_rad, noise_rad, float(threshold), float(certainty))


def profile(likelihood: Likelihood, quantity: Quantity) -> Profile:
    """Follow a quantity over its whole range, and find its confidence limits.

    Each point is fitted from its neighbour's fit, outwards from the optimum and
    back again, so that a basin which is lower further out is followed inwards. The
    limits are the outermost: what is between them need not all be within confidence,
    and where it is not is told as gaps.
    """
    fits = _Held(likelihood, quantity, _EXACT)
    start, grid = quantity.log(likelihood.best), grid_of(likelihood, quantity)
    middle = int(np.searchsorted(grid, start))
    outwards = [(i, i - 1) for i in range(middle + 1, len(grid))]
    outwards += [(i, i + 1) for i in range(middle - 1, -1, -1)]
    inwards = [(i, i - 1) for i in range(1, middle)]
    inwards += [(i, i + 1) for i in range(len(grid) - 2, middle, -1)]
    done = [fits.best] * len(grid)
    for index, neighbour in outwards:
        done[index] = fits.at(grid[index], done[neighbour])
    for index, neighbour in inwards:
        done[index] = _lower(done[index], fits.at(grid[index], done[neighbour]))
    limits = [fits.outermost(done, -1), fits.outermost(done, 1)]
    rises = np.array([point.rise for point in done])
    certainty = max(likelihood.certainty, likelihood.threshold)
    low = limits[0] if rises[0] > certainty else None
    high = limits[1] if rises[-1] > certainty else None
    points = Points(grid, rises, np.array([point.log_parameters for point in done]))
    smoothed([points], [[limit for limit in (low, high) if limit is not None]], fits.from_points)
    return profile_of(points, start, (low, high), likelihood.threshold)


Limits = tuple[float | None, float | None]


def profile_of(points: Points, best: float, limits: Limits, threshold: float) -> Profile:
    """Put a profile together from its points."""
    return Profile(
        points.values,
        points.rises,
        best,
        limits[0],
        limits[1],
        points.x[int(np.argmin(points.rises))],
        gaps_of(points.values, points.rises, threshold),
    )


def grid_of(likelihood: Likelihood, quantity: Quantity) -> Array:
    """Values over a quantity's whole range, ascending: its best, denser near by, and both ends."""
    low, high = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start = quantity.log(likelihood.best)
    near = start + likelihood.deviation(quantity) * _NEAR
    return np.unique(
        np.concatenate(
            ([start], near[(near > low) & (near < high)], np.linspace(low, high, _POINTS))
        )
    )


def limits_near(likelihood: Likelihood, quantity: Quantity) -> tuple[float | None, float | None]:
    """Confidence limits of the optimum's own basin, much faster than a whole profile.

    Where that basin leads over into a lower one, they are the limits of both.
    """
    fits = _Held(likelihood, quantity, _FAST)
    ends = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start, step = quantity.log(likelihood.best), likelihood.deviation(quantity)
    ends = min(ends[0], start), max(ends[1], start)
    found = []
    for end, sign in zip(ends, (-1, 1), strict=True):
        inner = fits.best
        limit = None
        for doubling in range(_MOST_DOUBLINGS):
            target = start + sign * 2.2 * step * 2**doubling
            target = max(target, end) if sign < 0 else min(target, end)
            outer = fits.at(target, inner)
            limit, outer = fits.crossing(inner, outer)
            if limit is not None or target == end:
                break
            inner = outer
        found.append(limit)
    return found[0], found[1]


@dataclass(frozen=True)
class _Point:
    """A quantity's logarithm, the rise of chi^2 there, and the fit; see `HeldFit`."""

    target: float
    rise: float
    log_parameters: Array
    bend: Array


def _lower(one: _Point, other: _Point) -> _Point:
    """Return the lower of two points; of equals, in single precision, the first."""
    return min(one, other, key=lambda point: np.float32(point.rise))


class _Held:
    """Fits with one quantity held."""

    def __init__(self, likelihood: Likelihood, quantity: Quantity, accuracy: _Accuracy) -> None:
        self._accuracy = accuracy
        self._likelihood = likelihood
        self._quantity = quantity
        self._longest_s = likelihood.problem.residuals.duration_s
        further = self._late if quantity.hinges else None
        self._objective = Objective(likelihood.problem, further)
        best = likelihood.best
        self.best = _Point(quantity.log(best), 0.0, best, np.zeros((len(best), len(best))))

    def at(self, target: float, near: _Point) -> _Point:
        """Fit at a target, from a point nearby."""
        found = held_fit(
            self._objective,
            self._quantity,
            target,
            near.log_parameters,
            near.bend,
            self._accuracy.fit,
        )
        residuals = self._likelihood.problem.residuals
        misfit = residuals.noise_scale_rad * float(np.sqrt(found.chi2 / residuals.samples))
        return _Point(target, self._likelihood.rise(misfit), found.log_parameters, found.bend)

    def from_points(self, _: IntArray, targets: Array, starts: Array) -> tuple[Array, Array]:
        """Fit at targets (n,) from log-parameters (n, n_parameters); see `smoothed`."""
        flat = np.zeros((starts.shape[1],) * 2)
        found = [
            self.at(float(target), _Point(target, np.inf, x, flat))
            for target, x in zip(targets, starts, strict=True)
        ]
        rises = np.array([point.rise for point in found])
        return rises, np.array([point.log_parameters for point in found])

    def outermost(self, points: list[_Point], sign: int) -> float | None:
        """Logarithm of the last crossing towards one end of a grid; points are lowered in place."""
        threshold = self._likelihood.threshold
        last = max(i * sign for i, point in enumerate(points) if point.rise < threshold) * sign
        while 0 <= last + sign < len(points):
            limit, outside = self.crossing(points[last], points[last + sign])
            if limit is not None:
                return limit
            last += sign
            points[last] = outside
        return None

    def crossing(self, inside: _Point, outside: _Point) -> tuple[float | None, _Point]:
        """Find where the rise is the threshold between two points.

        Every fit is tried from both sides, so that of two basins that meet in
        between it is the lower that is followed; and as far out as it is lower.

        Returns
        -------
        limit
            Logarithm; None if the rise at the outer point is below the threshold.
        outside
            The outer point, perhaps lowered.
        """
        threshold = self._likelihood.threshold
        allowed = self._accuracy.limit * threshold
        weights, was_inside = [1.0, 1.0], None
        for _ in range(_MOST_HALVINGS):
            if outside.rise < threshold:
                return None, outside
            # The square root of the rise is nearly linear.
            roots = np.sqrt(np.maximum([inside.rise, outside.rise], 0.0)) - np.sqrt(threshold)
            short, beyond = np.abs(roots) * weights
            share = float(short / (short + beyond)) if np.isfinite(beyond) else 0.5
            share = min(max(share, _LEAST_SHARE), 1 - _LEAST_SHARE)
            target = inside.target + share * (outside.target - inside.target)
            near, far = self.at(target, inside), self.at(target, outside)
            if far.rise - near.rise > allowed:
                outside = _lower(outside, self.at(outside.target, near))
                if outside.rise < threshold:
                    return None, outside
            point = _lower(near, far)
            if abs(point.rise - threshold) <= allowed:
                return target, outside
            # An end that stays twice counts half (Illinois).
            is_inside = point.rise < threshold
            again = 0.5 if is_inside is was_inside else 1.0
            weights = [1.0, again * weights[1]] if is_inside else [again * weights[0], 1.0]
            inside, outside = (point, outside) if is_inside else (inside, point)
            was_inside = is_inside
        return inside.target, outside

    def _late(self, x: Array) -> tuple[Array, Array]:
        """Rows, and slopes, that are zero as long as branches relax early enough.

        Their squares are a price in chi^2, and part of the rise.
        """
        values, slopes = [], []
        for hinge in self._quantity.hinges:
            form = hinge.form(len(x))
            beyond = float(form @ x) - hinge.allowed(self._longest_s)
            values.append(hinge.stiffness * max(beyond, 0.0))
            slopes.append(hinge.stiffness * form * (beyond > 0))
        return np.array(values), np.array(slopes)
