"""Tests of the residuals of a fit for white noise, each with its chance for the trace's own fit.

A fit of p parameters to n readings leaves M e of white noise e, where M = 1 - Q^T Q projects out
the directions Q that it absorbs. So ratios of quadratic forms of residuals, e^T M A M e / e^T M e,
have moments that are traces of M A, and follow nearly a beta distribution with the same mean and
variance, whatever the number of readings, their times and the standard deviation of the noise
[1]_. That of successive differences tests for correlation, that of means over stretches for what
is slow.

Residuals, (n_samples,), are over the noise's standard deviation where that is not the same. The
basis of what the fit absorbs has orthonormal rows, (n_directions, n_samples), as
`biogrip.fit.noise_model_fit.absorbed` returns them.

References
----------
.. [1] J. Durbin and G. S. Watson, Testing for serial correlation in least squares regression II,
   Biometrika 38 (1951), 159-177: section 4.
.. [2] J. Durbin, Tests for serial correlation in regression analysis based on the periodogram of
   least-squares residuals, Biometrika 56 (1969), 1-15.
.. [3] R. D. Cook and S. Weisberg, Residuals and Influence in Regression, Chapman and Hall, 1982:
   section 2.2.2, the test for an outlier.
.. [4] H. D. Patterson and R. Thompson, Recovery of inter-block information when block sizes are
   unequal, Biometrika 58 (1971), 545-554.
.. [5] F. E. Satterthwaite, An approximate distribution of estimates of variance components,
   Biometrics Bulletin 2 (1946), 110-114.
.. [6] H. Akaike, A new look at the statistical model identification, IEEE Transactions on Automatic
   Control 19 (1974), 716-723.
.. [7] R. A. Fisher, Tests of significance in harmonic analysis, Proceedings of the Royal Society
   of London A 125 (1929), 54-59.
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.physics.whitening import without

# Stretches over which residuals are averaged, and readings in the shortest.
_STRETCHES, _SHORTEST = 20, 5
# Sums of residuals that a misfit is estimated from; correlation lengths and shares of white noise
# that are tried, and by how much they have to lower the deviance [6]_.
_SUMS, _LENGTHS, _WHITE = 200, 10, (0.001, 0.03, 0.2, 0.6)
_TWO_MORE = 4.0
# A misfit that is smooth over half a trace would seem worth next to nothing: so few hardly lower
# the share of limits that hold.
_FEWEST, _LEAST_FREEDOM = 0.3, 3.0
# Least share of its variance that a fit leaves of a reading whose noise can be told.
_TOLD = 0.03
# Fewest periods of a line, since what is slower may be a misfit; its frequencies are so much finer
# than the periodogram's; and the largest difference of intervals, as a share, that is none.
_PERIODS, _FINER, _EVEN = 10, 16, 0.01


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

    def averaged(rows: Array) -> Array:
        sums: Array = np.add.reduceat(rows, starts, axis=-1) / np.sqrt(sizes)
        return sums

    observed = float(np.sum(averaged(residual) ** 2) / np.sum(residual**2))
    means = averaged(basis)
    within = means @ means.T
    first = count - float(np.trace(within))
    second = count - 2 * float(np.trace(within)) + float(np.sum(within**2))
    free = n - len(basis)
    if first < 1e-6 * count:
        return 1.0
    # The share of the rest is small where that of the means is large.
    return _chance_of_less(1 - observed, free - first, free - 2 * first + second, free, 1.0)


def averaged(basis: Array) -> Array:
    """Return orthonormal rows of means over stretches that a fit does not absorb."""
    n = basis.shape[1]
    count = min(_STRETCHES, n // _SHORTEST)
    rows = np.zeros((max(count, 0), n))
    for row, part in zip(
        rows, np.array_split(np.arange(n), count) if count > 1 else (), strict=False
    ):
        row[part] = len(part) ** -0.5
    rest = without(basis, rows)
    _, shares, found = np.linalg.svd(rest, full_matrices=False)
    kept: Array = found[shares > _TOLD]
    return kept


def _chance_of_less(observed: float, first: float, second: float, free: int, most: float) -> float:
    """Return the chance of a smaller ratio r^T A r / r^T r of what a fit leaves of white noise.

    The traces of M A and of its square are given, and the largest that the ratio can be.
    """
    from scipy.special import betainc

    mean = first / free
    variance = 2 * (second - first**2 / free) / (free * (free + 2))
    share = mean / most
    weight = share * (1 - share) / (variance / most**2) - 1
    chance = betainc(share * weight, (1 - share) * weight, min(max(observed / most, 0.0), 1.0))
    return float(chance)


def uneven(residual: Array, basis: Array) -> float:
    """Return the p-value of the cumulative periodogram test of white noise [2]_.

    The statistic is the largest distance between the cumulative periodogram and that of what the
    fit leaves of white noise, with Kolmogorov's distribution. The test detects noise with a
    correlation time of some readings and too small a share to correlate neighbours.
    """
    from scipy.fft import prev_fast_len
    from scipy.special import kolmogorov

    # A transform takes many times the memory if its length has no small factors.
    n = prev_fast_len(len(residual))
    places = slice(1, (n + 1) // 2)
    power = np.abs(np.fft.rfft(residual[:n])[places]) ** 2
    if len(power) < 2:
        return 1.0
    expected = np.full(len(power), float(n))
    for row in basis:
        expected -= np.abs(np.fft.rfft(row[:n])[places]) ** 2
    reached = np.cumsum(power)[:-1] / np.sum(power)
    shares = np.cumsum(expected)[:-1] / np.sum(expected)
    return float(kolmogorov(np.sqrt(len(power)) * np.max(np.abs(reached - shares))))


def find_line(residual: Array, time_s: Array) -> tuple[float, float, Array]:
    """Return the frequency of the strongest sine, its chance in white noise, and its directions.

    The chance is that of the largest ordinate of the periodogram [7]_, one where times are not
    evenly spaced; directions are cosine and sine as orthonormal rows, (2, n_samples).
    """
    n, apart = len(residual), np.diff(time_s)
    if n < 4 * _PERIODS or np.ptp(apart) > _EVEN * np.median(apart):
        return 0.0, 1.0, np.zeros((0, n))
    fine = np.abs(np.fft.rfft(residual, _FINER * n)[: _FINER * ((n + 1) // 2)]) ** 2
    power = fine[_FINER::_FINER]
    share = np.max(power[_PERIODS - 1 :]) / np.sum(power)
    slowest = _FINER * _PERIODS
    frequency = (slowest + np.argmax(fine[slowest:])) / (_FINER * n * np.mean(apart))
    angle = 2 * np.pi * frequency * time_s
    basis = np.linalg.qr(np.column_stack((np.cos(angle), np.sin(angle))))[0].T
    return float(frequency), min(len(power) * float(1 - share) ** (len(power) - 1), 1.0), basis


def by_leverage(residual: Array, basis: Array) -> Array:
    """Return residuals in their own standard deviations; those that a fit follows as they are."""
    share = 1 - np.sum(basis**2, axis=0)
    return np.where(share > _TOLD, residual / np.sqrt(np.maximum(share, _TOLD)), residual)


def far_out(residual: Array, struck: BoolArray, basis: Array) -> float:
    """Return the chance that white noise has readings as far out as those that are struck.

    They are held against the fit to the others, to first order: their distances are in standard
    deviations of these, with Student's distribution [3]_. That of the nearest of them, and their
    number, have Poisson's distribution, and so has that of the farthest alone.
    """
    from scipy.special import pdtrc, stdtr

    count = int(np.count_nonzero(struck))
    free = len(residual) - count - len(basis)
    if not count or free < 1:
        return 1.0
    own = basis[:, struck]
    left = np.eye(len(basis)) - own @ own.T
    if len(basis) and np.linalg.eigvalsh(left)[0] < _TOLD:
        return 1.0
    through = np.linalg.solve(left, own)
    residual = without(basis, residual)
    apart = residual[struck] + own.T @ (through @ residual[struck])
    others = float(np.sum(residual**2) - residual[struck] @ apart)
    scale = np.sqrt(max(others, 0.0) / free)
    if not scale:
        return 1.0
    away = np.abs(apart) / np.sqrt(1 + np.sum(own * through, axis=0)) / scale
    most, least = (2 * len(residual) * float(stdtr(free, -far)) for far in (away.max(), away.min()))
    # Two tests, so each at half the level.
    chance = 2 * min(float(pdtrc(0, most)), float(pdtrc(count - 1, least)))
    return min(chance, 1.0)


def as_correlated(residual: Array, basis: Array) -> tuple[float, float]:
    """Return how many independent residuals a misfit is worth, and the freedom of its variance.

    The misfit is taken for a random function of the reading's number, with a correlation that
    falls exponentially or as a Gaussian, and white noise; size, correlation length and share of the
    noise are those of highest restricted likelihood, which allows for what the fit absorbs [4]_. Of
    many residuals sums over stretches are taken, since what is slow matters.

    The n residuals count as this many: n times their mean square over the variance of the misfit in
    the direction, of those that the fit absorbs, in which it is largest. The freedom is
    (tr V)^2 / tr V^2 for the covariance V of what is left [5]_. Without a basis, what the fit
    absorbs is not known.
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
    lowest, found = lowest - _TWO_MORE, size * found
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
    return max(independent, _FEWEST), max(freedom, _LEAST_FREEDOM)


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
