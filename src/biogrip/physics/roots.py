"""Roots of functions of the rate, many at once.

The coefficients of a gripper-sample polynomial span dozens of decades. Iterating on the function
itself [1]_, [2]_, from starting radii read off the Newton polygon of its arms [3]_, keeps every
root to full relative accuracy, which an eigenvalue solver would not.

A network of springs and dampers with parallel Maxwell branches has as many modes as branches, or
one more. With branch rates p_0 < p_1 < ... the rates of the modes are the zeros of

    f(x) = sum_j w_j / (x - p_j) - b,    w_j, b > 0,

one in each interval between neighbouring rates and one beyond the last. Each is found independently
[4]_, as its distance from the nearer pole [5]_. So a zero close to a pole keeps all its digits.

References
----------
.. [1] L. W. Ehrlich, Communications of the ACM 10 (1967), 107-108.
.. [2] O. Aberth, Mathematics of Computation 27 (1973), 339-344: all zeros simultaneously.
.. [3] D. A. Bini, Numerical Algorithms 13 (1996), 179-200: starts from the Newton polygon.
.. [4] R.-C. Li, LAPACK Working Note 89 (1994): the middle way, matched in value and slopes.
.. [5] J. R. Bunch, C. P. Nielsen and D. C. Sorensen, Numerische Mathematik 31 (1978), 31-48.
.. [6] N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM, 2002, section 1.8.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray, IntArray

SMALLEST_GAP = 1e-6
"""Relative distance below which two roots are moved apart: partial fractions of two roots a gap g
apart lose eps/g, and moving them apart changes the response by g^2, both below 1e-9."""

# Most sweeps over roots that iterations find together, and over zeros of sums of poles.
_MOST_SWEEPS_OF_ROOTS, _MOST_SWEEPS_OF_ZEROS = 80, 60
# Share of a sum of poles below which it is zero, and of a distance below which a step is the last.
_LEAST_SHARE, _LAST_STEP = 4e-16, 1e-9


def spread_starts(coefficients: Array) -> ComplexArray:
    """Return starts for the roots of polynomials with positive coefficients, (n, degree).

    Coefficients are in ascending powers, (n, degree + 1). Moduli are slopes of the concave hull of
    log(coefficient) over power, the Newton polygon [3]_.
    """
    degree = coefficients.shape[1] - 1
    log = np.log(coefficients)
    hull = log.copy()
    for k in range(1, degree):
        for i in range(k):
            for j in range(k + 1, degree + 1):
                chord = log[:, i] + (log[:, j] - log[:, i]) * (k - i) / (j - i)
                hull[:, k] = np.maximum(hull[:, k], chord)
    # No symmetry, so that no two points can move in step.
    angles = np.pi + np.array([0.4, -0.9, 1.1, -0.25])[:degree] + 0.05 * np.arange(degree)
    return np.exp(hull[:, :-1] - hull[:, 1:]) * np.exp(1j * angles)


def find_zeros(
    points: ComplexArray, newton_step: Callable[[ComplexArray], ComplexArray]
) -> ComplexArray:
    """Move points onto the zeros of functions, all zeros of each at once (Ehrlich-Aberth).

    Points are (n, n_points), for each function as many as it has zeros; a Newton step is the
    function divided by its derivative. The result is zeros, pairwise at least `SMALLEST_GAP` apart.
    """
    off_diagonal = ~np.eye(points.shape[1], dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        converged = resting = np.zeros((len(points), 1), dtype=bool)
        for _ in range(_MOST_SWEEPS_OF_ROOTS):
            newton = newton_step(points)
            distances = points[..., None] - points[:, None]
            repulsion = np.where(off_diagonal, 1 / distances, 0).sum(axis=2)
            step = newton / (1 - newton * repulsion)
            # Converged points rest, so that their last bits do not depend on other functions.
            step = np.where(np.isfinite(step) & ~resting, step, 0)
            points = points - step
            if np.all(converged):
                break
            # The error is cubed in a sweep, so one more takes it below rounding.
            resting = converged
            converged = np.all(np.abs(step) <= 1e-8 * np.abs(points), axis=1, keepdims=True)
    return separate(points)


def separate(points: ComplexArray) -> ComplexArray:
    """Move points of each function, (n, n_points), that coincide apart to `SMALLEST_GAP`."""
    points = points.copy()
    for i, j in combinations(range(points.shape[1]), 2):
        distance, gap = points[:, i] - points[:, j], SMALLEST_GAP * points[:, i]
        lack = np.where(np.abs(distance) < np.abs(gap), 0.5 * (gap - distance), 0)
        points[:, i] += lack
        points[:, j] -= lack
    return points


@dataclass(frozen=True)
class Zeros:
    """Zeros of n functions, as distances from poles."""

    pole: Array
    """Pole that each zero is counted from, (n_zeros, n)."""
    beyond: NDArray[Any]
    """Distance of the zero from it; with complex weights the imaginary part is its derivative."""

    @property
    def values(self) -> NDArray[Any]:
        """Zeros, (n_zeros, n), ascending."""
        return self.pole + self.beyond

    def from_pole(self, pole: NDArray[Any]) -> NDArray[Any]:
        """Return distances of zeros from a pole of each function, (n,), without cancellation."""
        return (self.pole - pole) + self.beyond


def interlaced_zeros(weights: NDArray[Any], poles: NDArray[Any], level: NDArray[Any]) -> Zeros:
    """Return the zeros of sum_j w_j / (x - p_j) - b: each above its own pole and below the next.

    The zeros of a function are bitwise independent of the other functions. Weights and poles are
    (n_poles, n), levels (n,). Weights and levels are positive, poles ascend from zero; an imaginary
    part, far smaller than the real one, carries a derivative.
    """
    if not any(map(np.iscomplexobj, (weights, poles, level))):
        return _real_zeros(weights, poles, level)
    real = weights.real, poles.real, level.real
    if len(poles) > 2:
        # Samples that differ only in which derivative they carry have the same real parts.
        numbers, rows = dict[bytes, int](), np.concatenate((*real[:2], real[2][None])).T
        which = [numbers.setdefault(sample.tobytes(), len(numbers)) for sample in rows]
        first = np.unique(which, return_index=True)[1]
        of_some = _real_zeros(*(part[..., first] for part in real))
        zeros = Zeros(of_some.pole[:, which], of_some.beyond[:, which])
    else:
        zeros = _real_zeros(*real)
    # A Newton step is exact for an infinitesimal change of the weights.
    change = -np.imag(level) * np.ones_like(zeros.pole)
    slope = np.zeros_like(zeros.pole)
    for pole, weight in zip(poles, weights, strict=True):
        distance = zeros.from_pole(pole)
        term = weight / distance
        change += term.imag
        slope -= term.real / distance.real
    return Zeros(zeros.pole, zeros.beyond - 1j * change / slope)


# Up to so many points a matrix of poles and points is faster than a loop over the poles.
_FEW_POINTS = 500


class _Sides(NamedTuple):
    """Sums over the poles below given points and over those above, and derivatives of the sums."""

    below: Array
    below_slope: Array
    above: Array
    above_slope: Array


def zeros_of_one_branch(weights: Sequence[Array], rate: Array, level: Array) -> Zeros:
    """Return the zeros of w_0/x + w_1/(x - p) - b; weights, the rate p and the level b are (n,).

    Both are roots of quadratic equations, for x and for x - p, without cancellation [6]_.
    """
    (first, second), scaled = weights, level * rate
    half, product = 0.5 * (second + (first - scaled)), second * scaled
    larger = np.abs(half) + np.sqrt(half * half + product)
    beyond = np.where(half > 0, larger, product / larger) / level
    fast = rate + beyond
    slow = first * rate / (level * fast)
    near_zero = slow < 0.5 * rate
    return Zeros(
        np.array((np.where(near_zero, 0.0, rate), rate)),
        np.array((np.where(near_zero, slow, -second * rate / (level * beyond)), beyond)),
    )


def _real_zeros(weights: Array, poles: Array, level: Array) -> Zeros:
    if len(poles) == 1:
        return Zeros(poles, weights / level)
    if len(poles) == 2:
        return zeros_of_one_branch(tuple(weights), poles[1], level)
    pole, side, gap, start = _intervals(weights, poles, level)
    distance = start.copy()
    # State of the search for each unfinished zero: its pole, the side of it, the gap to the next
    # one, bounds of the distance, and the distance.
    search = np.array([pole, side, gap, np.zeros_like(pole), 0.5 * gap, start]).reshape(6, -1)
    left = np.arange(pole.size)
    for _ in range(_MOST_SWEEPS_OF_ZEROS):
        zero, which = np.divmod(left, len(level))
        origin, sign, whole, low, high, at = search
        sides = _sides(weights, poles, zero, which, Zeros(origin, sign * at))
        value = sides.below + sides.above - level[which]
        converged = np.abs(value) <= _LEAST_SHARE * (sides.below - sides.above + level[which])
        np.copyto(low, at, where=sign * value > 0)
        np.copyto(high, at, where=sign * value < 0)
        last = int(np.searchsorted(zero, len(poles) - 1))
        moved = _nearer(value, sides, sign, whole, at, level[which], last)
        outside = ~((moved > low) & (moved < high))
        np.copyto(moved, 0.5 * (low + np.minimum(high, 4 * at)), where=outside)
        np.copyto(moved, at, where=converged)
        # Convergence is quadratic, so after a short step the error is below rounding.
        converged |= np.abs(moved - at) <= _LAST_STEP * moved
        at[:] = distance.flat[left] = moved
        left, search = left[~converged], search[:, ~converged]
        if not len(left):
            break
    return Zeros(pole, side * distance)


def _intervals(weights: Array, poles: Array, level: Array) -> tuple[Array, Array, Array, Array]:
    """Return for each zero the nearest pole, the side of it, the gap to the next, and a start."""
    gaps = np.diff(poles, axis=0)
    # The sign at the middle of a gap tells which pole the zero is nearer to.
    zero, which = np.divmod(np.arange(gaps.size), len(level))
    middle = _sides(weights, poles, zero, which, Zeros(poles[:-1].ravel(), 0.5 * gaps.ravel()))
    below, below_slope, above, above_slope = (of.reshape(gaps.shape) for of in middle)
    value = below + above - level
    pole = np.concatenate((np.where(value > 0, poles[1:], poles[:-1]), poles[-1:]))
    side, gap, start = np.ones_like(pole), np.full_like(pole, np.inf), np.empty_like(pole)
    side[:-1], gap[:-1] = np.where(value > 0, -1.0, 1.0), gaps
    guess = _between(value, below_slope, above_slope, side[:-1], gaps, 0.5 * gaps)
    start[:-1] = np.where((guess > 0) & (guess < 0.5 * gaps), guess, 0.25 * gaps)
    # Lower bounds of the last zero: with the last pole only, and with all poles at zero.
    start[-1] = np.maximum(weights[-1], sum(weights) - level * poles[-1]) / level
    return pole, side, gap, start


def _sides(weights: Array, poles: Array, zero: IntArray, which: IntArray, at: Zeros) -> _Sides:
    """Return the sums at points, of last poles below, `zero`, and functions, pole by pole."""
    # A lone column would be summed by halves.
    if 1 < len(zero) <= _FEW_POINTS:
        terms = weights[:, which] / (slopes := (at.pole - poles[:, which]) + at.beyond)
        slopes = terms / slopes
        under = np.arange(len(poles))[:, np.newaxis] <= zero
        return _Sides(
            np.add.reduce(terms, axis=0, where=under),
            0.0 - np.add.reduce(slopes, axis=0, where=under),
            np.add.reduce(terms, axis=0, where=~under),
            0.0 - np.add.reduce(slopes, axis=0, where=~under),
        )
    below, below_slope, above, above_slope = np.zeros((4, len(zero)))
    term, slope = np.empty((2, len(zero)))
    firsts = np.searchsorted(zero, np.arange(len(poles))).tolist()
    for first, weight, pole in zip(firsts, weights, poles, strict=True):
        np.subtract(at.pole, pole[which], out=slope)
        slope += at.beyond
        np.divide(weight[which], slope, out=term)
        np.divide(term, slope, out=slope)
        below[first:] += term[first:]
        below_slope[first:] -= slope[first:]
        above[:first] += term[:first]
        above_slope[:first] -= slope[:first]
    return _Sides(below, below_slope, above, above_slope)


def _nearer(
    value: Array, sides: _Sides, side: Array, gap: Array, at: Array, level: Array, last: int
) -> Array:
    """Return improved distances of zeros from their poles; those from `last` on are beyond all."""
    inner = (value, sides.below_slope, sides.above_slope, side, gap, at)
    nearer = np.empty_like(value)
    nearer[:last] = _between(*(of[:last] for of in inner))
    # Beyond all poles the reciprocal of the sum is concave and nearly linear: Newton's method.
    slope = level[last:] * sides.below_slope[last:]
    nearer[last:] = at[last:] - sides.below[last:] * value[last:] / slope
    return nearer


def _between(
    value: Array, below_slope: Array, above_slope: Array, side: Array, gap: Array, at: Array
) -> Array:
    """Return the zero of c + p/d - q/(gap - d), matched in value and slopes [4]."""
    rest = gap - at
    p = -np.where(side > 0, below_slope, above_slope) * at * at
    q = -np.where(side > 0, above_slope, below_slope) * rest * rest
    c = side * value - p / at + q / rest
    half = 0.5 * (p + q - c * gap)
    root = np.sqrt(np.maximum(half * half + c * p * gap, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        zero: Array = np.where(half > 0, p * gap / (half + root), (root - half) / c)
    return zero
