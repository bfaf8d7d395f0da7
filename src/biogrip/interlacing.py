"""Zeros of sums of simple poles, which interlace with the poles: relaxation rates of networks.

A network of springs and dampers with parallel Maxwell branches has as many modes as branches, or
one more. With branch rates p_0 < p_1 < ... the rates of the modes are the zeros of

    f(x) = sum_j w_j / (x - p_j) - b,    w_j, b > 0,

one in each interval between neighbouring rates and one beyond the last. Each zero is found
independently, as its distance from the nearer pole. So a zero close to a pole keeps all its
digits, and no polynomial is needed, whose coefficients would span hundreds of decades.

References
----------
.. [1] R.-C. Li, Solving secular equations stably and efficiently, LAPACK Working Note 89
   (1994): both neighbouring poles matched in value and slope, the middle way.
.. [2] J. R. Bunch, C. P. Nielsen and D. C. Sorensen, Rank-one modification of the symmetric
   eigenproblem, Numerische Mathematik 31 (1978), 31-48.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array

_MOST_SWEEPS = 60
_ROUNDING, _SHORT = 4e-16, 1e-9
# Numbers in an array that fits into a processor's cache.
_FITS = 70_000


@dataclass(frozen=True)
class Zeros:
    """Zeros of n functions, as distances from poles."""

    pole: Array
    """Pole that each zero is counted from, (n_zeros, n)."""
    beyond: NDArray[Any]
    """Distance of the zero from that pole; for complex weights its derivative is the imaginary
    part."""

    @property
    def values(self) -> NDArray[Any]:
        """Zeros, (n_zeros, n), ascending."""
        return self.pole + self.beyond

    def from_pole(self, pole: Array) -> NDArray[Any]:
        """Return distances of zeros from a pole of each function, (n,), without cancellation."""
        return (self.pole - pole) + self.beyond


def interlaced_zeros(weights: NDArray[Any], poles: Array, level: NDArray[Any]) -> Zeros:
    """Return the zeros of sum_j w_j / (x - p_j) - b: each above its own pole and below the next.

    The zeros of a function are bitwise independent of the other functions. Weights and poles are
    (n_poles, n), levels (n,). Weights and levels are positive; an imaginary part, far smaller than
    the real one, carries a derivative. Poles are ascending and real.
    """
    if not (np.iscomplexobj(weights) or np.iscomplexobj(level)):
        return _real_zeros(weights, poles, level)
    # Samples that differ only in which derivative they carry have the same real parts.
    real = np.concatenate((weights.real, poles, level.real[None]))
    _, first, which = np.unique(real, axis=1, return_index=True, return_inverse=True)
    of_some = _real_zeros(weights.real[:, first], poles[:, first], level.real[first])
    found = Zeros(of_some.pole[:, which], of_some.beyond[:, which])
    # A Newton step is exact for an infinitesimal change of the weights.
    change = -np.imag(level) * np.ones_like(found.pole)
    slope = np.zeros_like(found.pole)
    for pole, weight in zip(poles, weights, strict=True):
        distance = found.from_pole(pole)
        term = weight / distance
        change += term.imag
        slope -= term.real / distance
    return Zeros(found.pole, found.beyond - 1j * change / slope)


@dataclass(frozen=True)
class _Sides:
    """Sums over the poles below given points and over those above, and derivatives of the sums."""

    below: Array
    below_slope: Array
    above: Array
    above_slope: Array


def _real_zeros(weights: Array, poles: Array, level: Array) -> Zeros:
    pole, side, gap, start = _intervals(weights, poles, level)
    found = np.empty_like(pole)
    # State of the search: indices of unfinished functions; for each zero its pole, the side of it,
    # the gap to the next one, bounds of the distance, the distance, and whether it has converged.
    which = np.arange(len(level))
    search = np.array([pole, side, gap, np.zeros_like(pole), 0.5 * gap, start])
    converged = np.zeros(pole.shape, dtype=bool)
    for _ in range(_MOST_SWEEPS):
        origin, sign, whole, low, high, at = search
        sides = _sides(weights, poles, Zeros(origin, sign * at))
        value = sides.below + sides.above - level
        converged |= np.abs(value) <= _ROUNDING * (sides.below - sides.above + level)
        np.copyto(low, at, where=sign * value > 0)
        np.copyto(high, at, where=sign * value < 0)
        moved = _nearer(value, sides, sign, whole, at, level)
        outside = ~((moved > low) & (moved < high))
        np.copyto(moved, 0.5 * (low + np.minimum(high, 4 * at)), where=outside)
        np.copyto(moved, at, where=converged)
        # Convergence is quadratic, so after a short step the error is below rounding.
        converged |= np.abs(moved - at) <= _SHORT * moved
        at[:] = found[:, which] = moved
        unfinished = ~np.all(converged, axis=0)
        if not np.any(unfinished):
            break
        if not np.all(unfinished):
            which, level, search = which[unfinished], level[unfinished], search[..., unfinished]
            weights, poles, converged = (of[:, unfinished] for of in (weights, poles, converged))
    return Zeros(pole, side * found)


def _intervals(weights: Array, poles: Array, level: Array) -> tuple[Array, Array, Array, Array]:
    """Return for each zero the nearest pole, the side of it, the gap to the next, and a start."""
    gaps = np.diff(poles, axis=0)
    # The sign at the middle of a gap tells which pole the zero is nearer to.
    middle = _sides(weights, poles, Zeros(poles[:-1], 0.5 * gaps))
    value = middle.below + middle.above - level
    pole = np.concatenate((np.where(value > 0, poles[1:], poles[:-1]), poles[-1:]))
    side, gap, start = np.ones_like(pole), np.full_like(pole, np.inf), np.empty_like(pole)
    side[:-1], gap[:-1] = np.where(value > 0, -1.0, 1.0), gaps
    guess = _between(value, middle.below_slope, middle.above_slope, side[:-1], gaps, 0.5 * gaps)
    start[:-1] = np.where((guess > 0) & (guess < 0.5 * gaps), guess, 0.25 * gaps)
    # Lower bounds of the last zero: with the last pole only, and with all poles at zero.
    start[-1] = np.maximum(weights[-1], sum(weights) - level * poles[-1]) / level
    return pole, side, gap, start


def _sides(weights: Array, poles: Array, at: Zeros) -> _Sides:
    """Return the sums in the order of the poles, vectorised if that fits into the cache."""
    few = len(poles) * at.pole.size <= _FITS
    return _sides_at_once(weights, poles, at) if few else _sides_in_turn(weights, poles, at)


def _sides_at_once(weights: Array, poles: Array, at: Zeros) -> _Sides:
    # Shape (n_poles, n, n_zeros), with the longest axis last.
    pole, beyond = np.ascontiguousarray(at.pole.T), np.ascontiguousarray(at.beyond.T)
    slope = pole - poles[:, :, None]
    slope += beyond
    term = weights[:, :, None] / slope
    np.divide(term, slope, out=slope)
    is_below, is_above = _which_side(*at.pole.shape[:1], *poles.shape[:1])
    # Reducing the first of several axes adds in sequence, so the result is reproducible.
    below, above, below_slope, above_slope = (
        np.add.reduce(of * which, axis=0).T
        for of in (term, slope)
        for which in (is_below, is_above)
    )
    return _Sides(below, -below_slope, above, -above_slope)


@cache
def _which_side(zeros: int, poles: int) -> tuple[Array, Array]:
    """Return ones where a pole is below a zero, and where it is above, (n_poles, 1, n_zeros)."""
    is_below = np.tri(zeros, poles).T[:, None]
    return is_below, 1 - is_below


def _sides_in_turn(weights: Array, poles: Array, at: Zeros) -> _Sides:
    below, below_slope, above, above_slope = np.zeros((4, *at.pole.shape))
    term, slope = np.empty((2, *at.pole.shape))
    for j, (weight, pole) in enumerate(zip(weights, poles, strict=True)):
        np.subtract(at.pole, pole, out=slope)
        slope += at.beyond
        np.divide(weight, slope, out=term)
        np.divide(term, slope, out=slope)
        below[j:] += term[j:]
        below_slope[j:] -= slope[j:]
        above[:j] += term[:j]
        above_slope[:j] -= slope[:j]
    return _Sides(below, below_slope, above, above_slope)


def _nearer(value: Array, sides: _Sides, side: Array, gap: Array, at: Array, level: Array) -> Array:
    """Return improved distances of zeros from their poles."""
    found = np.empty_like(value)
    inner = (value, sides.below_slope, sides.above_slope, side, gap, at)
    found[:-1] = _between(*(of[:-1] for of in inner))
    # Beyond all poles the reciprocal of the sum is concave and nearly linear: Newton's method.
    found[-1] = at[-1] - sides.below[-1] * value[-1] / (level * sides.below_slope[-1])
    return found


def _between(
    value: Array, below_slope: Array, above_slope: Array, side: Array, gap: Array, at: Array
) -> Array:
    """Return the zero of c + p/d - q/(gap - d), matched in value and slopes, one pole per side [1].

    Distances are from the nearer pole, so that d keeps all its digits.
    """
    rest = gap - at
    p = -np.where(side > 0, below_slope, above_slope) * at * at
    q = -np.where(side > 0, above_slope, below_slope) * rest * rest
    c = side * value - p / at + q / rest
    half = 0.5 * (p + q - c * gap)
    root = np.sqrt(np.maximum(half * half + c * p * gap, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Array = np.where(half > 0, p * gap / (half + root), (root - half) / c)
    return found
