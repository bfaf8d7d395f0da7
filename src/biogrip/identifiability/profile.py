"""Profile likelihood: how well a trace can still be fitted with one quantity held.

The rise of the sum of squares over its minimum, in units of the noise's
variance, is the rise of chi^2. Quantities are held by one stiff row of the
least squares, not exactly: what the fit comes out with is a constrained optimum
for the value it came out with, and that value is what is kept.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, fdtri

from biogrip.arrays import Array
from biogrip.identifiability.fisher import bound
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import FAIR, FINE, local_fit
from biogrip.identify.problem import Problem

# Steps away from the best fit, in standard deviations, that every profile has.
_NEAR = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_POINTS = 35
# The row yields by 1e-4 standard deviations at the confidence limits.
_STIFFNESS = 140.0
_CERTAIN = 0.999
# A branch may relax within twice the experiment at the price of chi^2 rising by some 50.
_HINGE = 10.0
_MOST_DOUBLINGS = 12


@dataclass(frozen=True)
class _Accuracy:
    """Of a fit, as the share of its cost that ends it; of a limit, as a share of its bracket."""

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
        freedom where the noise is known, F where it is estimated.
    certainty
        Rise that a profile must have reached at the end of the range to be closed
        there; the same at 99.9 %. A profile that levels off between the two has
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
        """Standard deviation of a quantity's logarithm to first order; at most one e-fold."""
        _, sensitivity = self.problem.residuals(self.best)
        return min(bound(sensitivity, self.noise_rad, self.best, quantity), 1.0)


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
    """

    log_values: Array
    rises: Array
    best: float
    low: float | None
    high: float | None


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
    levels = np.array([confidence, _CERTAIN])
    if noise_rad is not None:
        threshold, certainty = chdtri(1, 1 - levels)
    else:
        left = problem.residuals.free - len(best)
        noise_rad = misfit_rad * float(np.sqrt(problem.residuals.samples / left))
        threshold, certainty = fdtri(1, left, levels)
    return Likelihood(problem, best, misfit_rad, noise_rad, float(threshold), float(certainty))


def profile(likelihood: Likelihood, quantity: Quantity) -> Profile:
    """Follow a quantity over its whole range, and find its confidence limits.

    Each point is fitted from its neighbour's fit, outwards from the optimum and
    back again, so that a basin which is lower further out is followed inwards.
    """
    fits = _Held(likelihood, quantity, _EXACT)
    start, grid = quantity.log(likelihood.best), grid_of(likelihood, quantity)
    middle = int(np.searchsorted(grid, start))
    outwards = [(i, i - 1) for i in range(middle + 1, len(grid))]
    outwards += [(i, i + 1) for i in range(middle - 1, -1, -1)]
    inwards = [(i, i - 1) for i in range(1, middle)]
    inwards += [(i, i + 1) for i in range(len(grid) - 2, middle, -1)]
    done = [(0.0, likelihood.best)] * len(grid)
    for index, neighbour in outwards:
        done[index] = fits.at(grid[index], done[neighbour][1])
    for index, neighbour in inwards:
        found = fits.at(grid[index], done[neighbour][1])
        done[index] = min(done[index], found, key=lambda point: point[0])
    rises = np.array([rise for rise, _ in done])
    inside = np.flatnonzero(rises < likelihood.threshold)
    certainty = max(likelihood.certainty, likelihood.threshold)
    first, last = int(inside[0]), int(inside[-1])
    return Profile(
        grid,
        rises,
        start,
        fits.crossing(grid, done, first, first - 1) if rises[0] > certainty else None,
        fits.crossing(grid, done, last, last + 1) if rises[-1] > certainty else None,
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
    """Confidence limits of the optimum's own basin, much faster than a whole profile."""
    fits = _Held(likelihood, quantity, _FAST)
    ends = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start, step = quantity.log(likelihood.best), likelihood.deviation(quantity)
    found = []
    for end, sign in zip(ends, (-1, 1), strict=True):
        inner, inner_point = start, (0.0, likelihood.best)
        limit = None
        for doubling in range(_MOST_DOUBLINGS):
            outer = start + sign * 2.2 * step * 2**doubling
            outer = max(outer, end) if sign < 0 else min(outer, end)
            outer_point = fits.at(outer, inner_point[1])
            if outer_point[0] >= likelihood.threshold:
                pair = np.array([inner, outer])
                limit = fits.crossing(pair, [inner_point, outer_point], 0, 1)
                break
            if outer == end:
                break
            inner, inner_point = outer, outer_point
        found.append(limit)
    return found[0], found[1]


class _Held:
    """Fits with one quantity held."""

    def __init__(self, likelihood: Likelihood, quantity: Quantity, accuracy: _Accuracy) -> None:
        self._accuracy = accuracy
        self._likelihood = likelihood
        self._quantity = quantity
        self._stiffness = _STIFFNESS / likelihood.deviation(quantity)
        self._longest = float(np.log(likelihood.problem.residuals.duration_s))

    def at(self, target: float, near: Array) -> tuple[float, Array]:
        """Rise of chi^2, and log-parameters, with the quantity at a target."""

        def held(x: Array) -> tuple[Array, Array]:
            values = [self._stiffness * (self._quantity.log(x) - target)]
            slopes = [self._stiffness * self._quantity.gradient(x)]
            for spring, damper in self._quantity.branches:
                beyond = x[damper] - x[spring] - self._longest
                slope = np.zeros_like(x)
                if beyond > 0:
                    slope[damper], slope[spring] = _HINGE, -_HINGE
                values.append(_HINGE * max(beyond, 0.0))
                slopes.append(slope)
            return np.array(values), np.array(slopes)

        start = self._quantity.moved(near, target)
        found = local_fit(self._likelihood.problem, start, self._accuracy.fit, held)
        return self._likelihood.rise(found.misfit_rad), found.log_parameters

    def crossing(
        self, grid: Array, points: list[tuple[float, Array]], inside: int, outside: int
    ) -> float:
        """Logarithm at which the rise reaches the threshold between two points of a grid."""
        wanted = np.sqrt(self._likelihood.threshold)
        known = {
            float(grid[inside]): points[inside][0],
            float(grid[outside]): points[outside][0],
        }

        def excess(target: float) -> float:
            # The square root of the rise is nearly linear.
            rise = known.get(target)
            if rise is None:
                rise = self.at(target, points[inside][1])[0]
            return float(np.sqrt(max(rise, 0.0)) - wanted)

        width = abs(float(grid[inside] - grid[outside]))
        xtol = self._accuracy.limit * width
        return float(brentq(excess, grid[inside], grid[outside], xtol=xtol, rtol=1e-12))
