"""Tests of what a fit leaves, each with its chance in white noise for the trace's own fit.

A fit of p parameters to n readings leaves M e of white noise e, where M = 1 - Q^T Q projects out
the directions Q that it absorbs. So ratios of quadratic forms of residuals, e^T M A M e / e^T M e,
have moments that are traces of M A, and follow nearly a beta distribution with the same mean and
variance [1]_. That of successive differences tests for correlation, that of means over stretches
for what is slow.

A step of all readings from some time on is one direction more: its share of the sum of squares is
beta-distributed in white noise. `find_step` scans all times. Inertia in a frequency sweep is one
direction more, too.

Residuals, (n_samples,), are over the noise's standard deviation where that is not the same. The
basis of what the fit absorbs has orthonormal rows, (n_directions, n_samples), see `absorbed`.

References
----------
.. [1] J. Durbin and G. S. Watson, Biometrika 38 (1951), 159-177: section 4.
.. [3] R. D. Cook and S. Weisberg, Residuals and Influence in Regression, 1982: section 2.2.2.
.. [4] H. D. Patterson and R. Thompson, Biometrika 58 (1971), 545-554: restricted likelihood.
.. [5] F. E. Satterthwaite, Biometrics Bulletin 2 (1946), 110-114.
.. [6] H. Akaike, IEEE Transactions on Automatic Control 19 (1974), 716-723.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaincc, fdtrc, pdtrc, stdtr

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.digits import plain
from biogrip.physics.noise import without
from biogrip.physics.protocol import is_storage
from biogrip.physics.residuals import Residuals

# Stretches over which residuals are averaged, and readings in the shortest.
_STRETCHES, _SHORTEST = 20, 5
# Sums that a misfit is estimated from; correlation lengths and shares of white noise to try.
_SUMS, _LENGTHS, _WHITE = 200, 10, (0.001, 0.03, 0.2, 0.6)


def correlated(residual: Array, basis: Array) -> tuple[float, float]:
    """Return the correlation of neighbouring residuals, and the chance of as much in white noise.

    The statistic is that of Durbin and Watson, d = sum (r_i+1 - r_i)^2 / sum r_i^2 [1]_, the
    correlation 1 - d/2 relative to the mean of d; the chance is that of a smaller d. A fit that
    absorbs all but one direction leaves nothing to chance.
    """
    n = len(residual)
    if n - len(basis) < 2:
        return 0.0, 1.0
    observed = float(np.sum(np.diff(residual) ** 2) / np.sum(residual**2))
    differences = np.diff(basis)
    # A Q^T, for the matrix A = D^T D of differences D.
    through = np.zeros_like(basis)
    through[:, 1:] += differences
    through[:, :-1] -= differences
    within = differences @ differences.T
    first = 2 * (n - 1) - float(np.trace(within))
    second = 2 * (3 * n - 4) - 2 * float(np.sum(through**2)) + float(np.sum(within**2))
    free = n - len(basis)
    chance = _chance_of_less(observed, first, second, free, 4.0)
    return 1 - observed * free / first, chance


def is_still(values: Array) -> bool:
    """Return True if values only scatter about their mean, (n,): neither rise nor wander.

    Of too few no trend is told, unless they are all the same.
    """
    if np.ptp(values) == 0:
        return True
    apart, basis = values - np.mean(values), np.full((1, len(values)), len(values) ** -0.5)
    chances = correlated(apart, basis)[1], wandering(apart, basis)
    return len(values) >= levels.FEWEST_STILL and min(chances) >= levels.FALSE_ALARM


def wandering(residual: Array, basis: Array) -> float:
    """Return the chance of means over stretches of white noise that scatter as much.

    The statistic is the share of the sum of squares that these means have. The test detects parts
    of the spectrum below some ten periods a trace, however small they are beside single readings'
    noise.
    """
    n, count = len(residual), min(_STRETCHES, len(residual) // _SHORTEST)
    if count < 2:
        return 1.0
    sizes = np.array([len(part) for part in np.array_split(residual, count)])
    starts = np.append(0, np.cumsum(sizes)[:-1])

    def means_of(rows: Array) -> Array:
        return np.add.reduceat(rows, starts, axis=-1) / np.sqrt(sizes)

    observed = float(np.sum(means_of(residual) ** 2) / np.sum(residual**2))
    means = means_of(basis)
    within = means @ means.T
    first = count - float(np.trace(within))
    second = count - 2 * float(np.trace(within)) + float(np.sum(within**2))
    free = n - len(basis)
    if first < 1e-6 * count:
        return 1.0
    # The share of the rest is small where that of the means is large.
    return _chance_of_less(1 - observed, free - first, free - 2 * first + second, free, 1.0)


def _chance_of_less(observed: float, first: float, second: float, free: int, most: float) -> float:
    """Return the chance of a smaller ratio, by the traces of M A and its square, and the most."""
    mean = first / free
    variance = 2 * (second - first**2 / free) / (free * (free + 2))
    share = mean / most
    weight = share * (1 - share) / (variance / most**2) - 1
    return float(betainc(share * weight, (1 - share) * weight, np.clip(observed / most, 0.0, 1.0)))


def by_leverage(residual: Array, basis: Array) -> Array:
    """Return residuals in their own standard deviations; those that a fit follows as they are."""
    share, least = 1 - np.sum(basis**2, axis=0), levels.TOLD
    return np.where(share > least, residual / np.sqrt(np.maximum(share, least)), residual)


def far_out(residual: Array, struck: BoolArray, basis: Array, freedom: float = np.inf) -> float:
    """Return the chance that white noise has readings as far out as those that are struck.

    The noise is known with this freedom at most.

    Their distances from the fit to the others, to first order, are in standard deviations of these,
    with Student's distribution [3]_. That of the nearest of them, and their number, have Poisson's
    distribution, and so has that of the farthest alone.
    """
    count = int(np.count_nonzero(struck))
    free = len(residual) - count - len(basis)
    if not count or free < 1:
        return 1.0
    own = basis[:, struck]
    left = np.eye(len(basis)) - own @ own.T
    if len(basis) and np.linalg.eigvalsh(left)[0] < levels.TOLD:
        return 1.0
    through = np.linalg.solve(left, own)
    residual = without(basis, residual)
    apart = residual[struck] + own.T @ (through @ residual[struck])
    others = float(np.sum(residual**2) - residual[struck] @ apart)
    scale = np.sqrt(max(others, 0.0) / free)
    if not scale:
        return 1.0
    away = np.abs(apart) / np.sqrt(1 + np.sum(own * through, axis=0)) / scale
    known = min(free, freedom)
    most = 2 * len(residual) * float(stdtr(known, -away.max()))
    least = 2 * len(residual) * float(stdtr(known, -away.min()))
    # Two tests, so each at half the level.
    chance = 2 * min(float(pdtrc(0, most)), float(pdtrc(count - 1, least)))
    return min(chance, 1.0)


def as_correlated(residual: Array, basis: Array) -> tuple[float, float]:
    """Return how many independent residuals a misfit is worth, and the freedom of its variance.

    The misfit is taken for a random function of the reading's number, with a correlation that falls
    exponentially or as a Gaussian, and white noise, of highest restricted likelihood [4]_, which
    allows for what the fit absorbs. Of many residuals sums over stretches are taken. The n
    residuals count as n times their mean square over the variance of the misfit in the direction,
    of those that the fit absorbs, in which it is largest. The freedom is (tr V)^2 / tr V^2 for the
    covariance V of what is left [5]_. Without a basis, what the fit absorbs is not known.
    """
    n = len(residual)
    sums = min(n, _SUMS)
    starts = np.arange(sums) * n // sums
    sizes = np.diff(np.append(starts, n))
    rows = np.vstack((basis if len(basis) else np.full((1, n), n**-0.5), residual))
    rows = np.add.reduceat(rows, starts, axis=-1) / np.sqrt(sizes)
    left, taken = rows[-1], np.linalg.qr(rows[:-1].T)[0]
    apart = np.abs(np.subtract.outer(np.arange(sums), np.arange(sums)))
    found = np.eye(sums)
    lowest, size = _restricted(found, left, taken)
    lowest, found = lowest - levels.TWO_MORE, size * found
    for length in np.geomspace(1, max(sums / 2, 2), _LENGTHS):
        for kernel in (np.exp(-apart / length), np.exp(-0.5 * (apart / length) ** 2)):
            for white in _WHITE:
                covariance = (1 - white) * kernel + white * np.eye(sums)
                deviance, size = _restricted(covariance, left, taken)
                if deviance < lowest:
                    lowest, found = deviance, size * covariance
    largest = float(np.linalg.eigvalsh(taken.T @ found @ taken)[-1])
    remaining = found - taken @ (taken.T @ found)
    freedom = float(np.trace(remaining) ** 2 / np.sum(remaining * remaining.T))
    independent = min(n * float(np.mean(residual**2)) / largest, float(n - len(basis)))
    return max(independent, levels.FEWEST_INDEPENDENT), max(freedom, levels.LEAST_FREEDOM)


def _restricted(covariance: Array, left: Array, taken: Array) -> tuple[float, float]:
    """Return the restricted deviance of residuals, and the factor of their covariance."""
    from scipy.linalg import solve_triangular

    root = np.linalg.cholesky(covariance)
    white = solve_triangular(root, np.column_stack((taken, left)), lower=True)
    basis, triangle = np.linalg.qr(white[:, :-1])
    rest = white[:, -1] - basis @ (basis.T @ white[:, -1])
    free = len(left) - taken.shape[1]
    size = float(rest @ rest) / free
    determinants = np.log(np.diag(root)).sum() + np.log(np.abs(np.diag(triangle))).sum()
    return free * np.log(size) + 2 * float(determinants), size


# Most numbers in the steps that are scanned.
_AT_ONCE = 4_000_000


@dataclass(frozen=True)
class Step:
    """The step that lowers the sum of squares of residuals the most."""

    before: int
    """Index of the first reading after it."""
    size: float
    """Its size in the unit of the residuals."""
    chance: float
    """Chance of as much in white noise, at any time."""
    left: Array
    """What a fit leaves with it, to first order, (n_samples,)."""
    basis: Array
    """What such a fit absorbs, (n_directions + 1, n_samples)."""


def find_step(residual: Array, basis: Array, cleared: Callable[[Array], Array]) -> Step | None:
    """Scan residuals for a step that a fit would leave; None where none can be told.

    `cleared` turns functions of time, (n, n_samples), into residuals. Of very many readings not
    every one is the first of a step. Its chance is at most as said: that of one step times their
    number.
    """
    samples, free = len(residual), len(residual) - len(basis)
    count = min(samples - 1, max(_AT_ONCE // samples, 1))
    before = np.unique(np.linspace(1, samples - 1, count).astype(np.int64))
    whole = cleared((np.arange(samples) >= before[:, None]).astype(float))
    of_whole = np.einsum("ij,ij->i", whole, whole)
    square = of_whole - np.sum((whole @ basis.T) ** 2, axis=1)
    # The step back is the same step if a constant is absorbed.
    (constant,) = cleared(np.ones((1, samples)))
    back = of_whole - 2 * (whole @ constant) + constant @ constant
    told = np.flatnonzero(square > levels.TOLD * np.minimum(of_whole, back))
    if not len(told) or free < 2:
        return None
    # No matrix of what is left of all steps is formed, which takes most of the time.
    along = (whole @ without(basis, residual))[told] / np.sqrt(square[told])
    largest = int(np.argmax(np.abs(along)))
    step, size = told[largest], float(along[largest])
    norm = float(np.sqrt(square[step]))
    direction = without(basis, whole[step]) / norm
    share = min(size**2 / float(residual @ residual), 1.0)
    return Step(
        int(before[step]),
        size / norm,
        min(len(told) * float(betaincc(0.5, 0.5 * (free - 1), share)), 1.0),
        residual - size * direction,
        np.vstack((basis, direction)),
    )


def find_inertia(
    residuals: Residuals, residual: Array, basis: Array, growth: Array | float = 1.0
) -> tuple[bool, str]:
    """Return True if an F test tells inertia, and in words what may make moduli wrong."""
    places, free = residuals.trace.time_s, len(residual) - len(basis)
    squared = np.where(is_storage(places), places**2, 0.0)
    shape = without(basis, residuals.trace.condensed.cleared(squared) / growth)
    total, square = float(residual @ residual), float(shape @ shape)
    # Of a loss modulus alone, nothing.
    size = float(shape @ residual) / max(square, np.finfo(float).tiny)
    explained = size**2 * square
    known = min(free - 1, residuals.freedom)
    if fdtrc(1, known, explained * (free - 1) / (total - explained)) >= levels.FALSE_ALARM:
        what = "a column of something else, slip, too large a strain, or a sample that changed"
        return False, what
    part = plain(100 * abs(size) * float(places[-1]) ** 2 / float(residuals.trace.readings[-1]), 2)
    return True, (
        "inertia of the instrument or the sample, as the storage modulus has a part that goes with "
        f"the frequency squared, {part} % at the highest: correct for it, or leave the highest "
        "frequencies out (--until)"
    )
