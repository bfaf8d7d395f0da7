"""Sampling times under noise with memory: readings spread over cells of time.

Noise with memory is a sum of Ornstein-Uhlenbeck processes. In a cell of time it is taken as its
mean there, which all readings of the cell share and which is correlated with the means of other
cells, and a rest that is independent from reading to reading. Means of such a process over times
have covariances in closed form, exponential between cells, so that the covariance matrix
factorises in linear time [1]_.

With n readings of variance v in each cell, and covariances K of the means, the information is
S^T (v/n + K)^-1 S: a parallel sum, which is concave in n [2]_. A concave function of convex
combinations is maximised as in `biogrip.design.sampling`: what a reading more in each cell would
tell is the square of the sensitivity that the others leave unexplained.

References
----------
.. [1] D. Foreman-Mackey, E. Agol, S. Ambikasaran and R. Angus, Fast and scalable Gaussian
   process modeling with applications to astronomical time series, The Astronomical Journal 154
   (2017), 220: celerite.
.. [2] W. N. Anderson and R. J. Duffin, Series and parallel addition of matrices, Journal of
   Mathematical Analysis and Applications 26 (1969), 576-594.
"""

from collections.abc import Callable

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.criteria import Criterion, inverted
from biogrip.design.sampling import (
    Mixing,
    compute_covariances,
    fill,
    fill_evenly,
    gap_of,
    improve_shares,
)

# Fillings, at most; gap at which to stop; improvements of their mixture after each.
_FILLINGS, _GAP = 60, 0.005
_MIXING = Mixing(tries=4, least_decrease=0.0, sharper=1.3, sharpest=300.0)
# Power of the p-norm that replaces a maximum, at first.
_BLUNT = 10.0
# Readings of a cell that has none, and least share of independent noise in a cell.
_NONE, _INDEPENDENT = 1e-7, 1e-3
# Lengths of a cell over relaxation times from which on its mean is correlated with no other.
_LONG = 30.0


class CellNoise:
    """Noise of readings in ascending cells of time, over its variance.

    Parameters
    ----------
    middle_s, lasting_s : (n_cells,)
        Middle and length of each cell.
    shares, rates : (n_processes,)
        Shares of Ornstein-Uhlenbeck processes in the variance, and their rates in 1/s.
    """

    def __init__(self, middle_s: Array, lasting_s: Array, shares: Array, rates: Array) -> None:
        # Imported here, for loading celerite takes a tenth of a second.
        from celerite2 import driver

        self._driver = driver
        self._middle_s = np.ascontiguousarray(middle_s)
        self._rates = rates
        lengths = lasting_s[:, None] * rates
        mean = shares * _mean_variance(lengths)
        self.shared = mean.sum(axis=1)
        """Variance of the mean over each cell, (n_cells,)."""
        self.alone = np.maximum(1.0 - self.shared, _INDEPENDENT)
        """Variance of what each reading has for itself, (n_cells,)."""
        self._right = np.where(lengths < _LONG, _sinhc(np.minimum(lengths, _LONG) / 2), 0.0)
        self._left = shares * self._right

    def respond(self, rows: Array, readings: Array) -> tuple[Array, Array]:
        """Compute the information of readings, and the roots of its derivatives.

        Parameters
        ----------
        rows : (n, n_parameters, n_cells)
            Sensitivities in units of the noise.
        readings : (n_cells,)
            Readings in each cell.

        Returns
        -------
        information : (n, n_parameters, n_parameters)
        roots : (n, n_parameters, n_cells)
            Their squares are the information of a reading more in each cell.
        """
        alone = self.alone / np.maximum(readings, _NONE)
        columns = np.ascontiguousarray(rows.reshape(-1, rows.shape[2]).T)
        given = self._middle_s, self._rates, self._left
        pivots, right = self._driver.factor(
            self._middle_s,
            self._rates,
            alone + self.shared,
            self._left,
            self._right,
            np.empty_like(alone),
            np.empty_like(self._right),
        )
        lower = self._driver.solve_lower(*given, right, columns, np.empty_like(columns))
        lower /= pivots[:, None]
        solved = self._driver.solve_upper(*given, right, lower, np.empty_like(columns))
        weighed = solved.T.reshape(rows.shape)
        information = rows @ weighed.swapaxes(1, 2)
        return (information + information.swapaxes(1, 2)) / 2, weighed * alone / np.sqrt(self.alone)


def spread_readings(
    rows: Array,
    noise: CellNoise,
    capacity: Array,
    samples: int,
    criterion: Criterion,
    before: Array | float = 0.0,
) -> Array:
    """Distribute readings over cells, (n_cells,), such that a criterion is nearly minimal.

    The arguments are those of `biogrip.design.sampling.best_sampling`.
    """
    room = min(float(samples), float(capacity.sum()))
    fillings, shares = [fill_evenly(capacity, room)], np.ones(1)
    best, lowest = fillings[0], np.inf
    for round_ in range(_FILLINGS):
        sharpness = min(_MIXING.sharpest, _BLUNT * _MIXING.sharper**round_)
        shares = _mixed(np.array(fillings), shares, rows, noise, criterion, before, sharpness)
        readings = shares @ np.array(fillings)
        covariances, worth = _rate(readings, rows, noise, criterion, before, sharpness)
        if (bound := criterion.typical_bound(covariances)) < lowest:
            best, lowest = readings, bound
        filling = fill(worth, capacity, room)
        if gap_of(criterion, covariances, float(worth @ (filling - readings)), sharpness) < _GAP:
            break
        fillings.append(filling)
        shares = np.append(shares * (1 - 1 / len(fillings)), 1 / len(fillings))
    return best


def _rate(
    readings: Array,
    rows: Array,
    noise: CellNoise,
    criterion: Criterion,
    before: Array | float,
    sharpness: float,
) -> tuple[Array, Array]:
    """Return covariances of the parameters asked for, and what a reading more in each is worth."""
    information, roots = noise.respond(rows, readings)
    covariances, of_samples, slope = compute_covariances(
        inverted(information + before), criterion, sharpness
    )
    return covariances, of_samples @ np.einsum("npc,npc->nc", slope @ roots, roots)


def _mixed(
    fillings: Array,
    shares: Array,
    rows: Array,
    noise: CellNoise,
    criterion: Criterion,
    before: Array | float,
    sharpness: float,
) -> Array:
    """Improve the shares of fillings."""
    if len(shares) == 1:
        return shares

    def at(shares: Array) -> tuple[float, Callable[[], Array]]:
        covariances, worth = _rate(shares @ fillings, rows, noise, criterion, before, sharpness)
        return criterion.smooth(covariances, sharpness), lambda: fillings @ worth

    return improve_shares(shares, criterion, _MIXING, at)


def whole_along(readings: Array) -> IntArray:
    """Round numbers of readings to integers, such that those up to each cell keep their sum."""
    along = np.floor(np.cumsum(readings) + 0.5 + 1e-9)
    return np.diff(along, prepend=0.0).astype(np.intp)


def effective_capacity(capacity: Array, lasting_s: Array, shares: Array, rates: Array) -> Array:
    """Return how many independent readings those of a cell are worth at most, (n_cells,).

    Readings of an Ornstein-Uhlenbeck process over a time L tell of its mean what 1 + L/(2 tau)
    independent ones do.
    """
    least = (shares / (1 + 0.5 * lasting_s[:, None] * rates)).sum(axis=1)
    return np.minimum(capacity, 1 / np.maximum(least, 1e-12))


def _mean_variance(lengths: Array) -> Array:
    """Return the variance of the mean of a process over stretches in relaxation times."""
    y = np.maximum(lengths, 1e-4)
    return np.where(lengths < 1e-4, 1 - lengths / 3, 2 / y * (1 + np.expm1(-y) / y))


def _sinhc(x: Array) -> Array:
    y = np.maximum(x, 1e-4)
    return np.where(x < 1e-4, 1.0, np.sinh(y) / y)
