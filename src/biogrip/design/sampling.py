"""Optimal sampling times of a given experiment, with a bound on the distance from the optimum.

Time is divided into cells in which sensitivities hardly change. A share w_i of the readings falls
into each, limited by the fastest sampling. The information is linear in w and the criterion
convex in the information, so the best w solves a convex problem. It is solved by simplicial
decomposition [1]_: the linear problem of filling the most informative cells is solved by sorting,
and the best mixture of all fillings so far is found by a multiplicative algorithm [2]_.

The equivalence theorem for designs with bounded weights [3]_ says that w is optimal if no other
filling has a larger value of the gradient. The gap is the excess of the best filling over w:
the criterion exceeds its optimum by no more.

References
----------
.. [1] B. von Hohenbalken, Simplicial decomposition in nonlinear programming algorithms,
   Mathematical Programming 13 (1977), 49-68.
.. [2] S. D. Silvey, D. M. Titterington and B. Torsney, An algorithm for optimal designs on a
   finite design space, Communications in Statistics A 7 (1978), 1379-1389.
.. [3] H. P. Wynn, Optimum submeasures with applications to finite population sampling, in
   Statistical Decision Theory and Related Topics III, vol. 2 (1982), 485-495.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion, inverted

# Power p of the p-norm that replaces a maximum, at first; and where a search goes on from a
# sampling that was nearly as good.
_BLUNT, _KNOWN = 10.0, 100.0
# Powers that are tried for the least bound.
_POWERS = 13
# A filling with less than this share of a mixture is dropped.
_DROPPED = 1e-9
# Fillings of which a search goes on: those with the largest shares, above the least.
_LEFT, _LEAST = 12, 1e-4


@dataclass(frozen=True)
class Mixing:
    """How far a mixture of fillings is improved before the next filling is added."""

    tries: int
    """Most steps."""
    least_decrease: float
    """Decrease of the criterion's logarithm in a step; one with less is the last."""
    sharper: float
    """Growth, with every filling, of the power p of the p-norm that replaces a maximum."""
    sharpest: float
    """Largest power: a logarithm is off by up to that of the number of values over it."""


ROUGH = Mixing(tries=15, least_decrease=1e-4, sharper=1.5, sharpest=1e3)
"""For gaps down to a thousandth."""
FINE = Mixing(tries=100, least_decrease=1e-7, sharper=1.1, sharpest=1e4)
"""For gaps down to a ten-thousandth."""


@dataclass(frozen=True)
class Mixture:
    """A mixture of fillings: readings in each cell as a weighted mean."""

    fillings: Array
    """Readings in each cell, not integer, (n_fillings, n_cells)."""
    shares: Array
    """Weights whose sum is one, (n_fillings,)."""

    @property
    def main(self) -> "Mixture":
        """The fillings of the largest shares, ten or so."""
        kept = np.argsort(-self.shares, kind="stable")[:_LEFT]
        kept = kept[self.shares[kept] > _LEAST]
        return Mixture(self.fillings[kept], self.shares[kept] / self.shares[kept].sum())

    def within(self, capacity: Array, room: float) -> "Mixture":
        """Return the mixture with every filling cut to a capacity and filled up evenly."""
        fillings = np.minimum(self.fillings, capacity)
        free = capacity - fillings
        missing = np.maximum(room - fillings.sum(axis=1), 0.0)
        there = free.sum(axis=1)
        fillings += free * (missing / np.where(there > 0, there, 1.0))[:, None]
        return Mixture(fillings, self.shares)


@dataclass(frozen=True)
class Optimum:
    """The optimal sampling."""

    samples: Array
    """Numbers of readings in each cell, not integer, (n_cells,)."""
    covariances: Array
    """Covariances of the log-parameters asked for, of each plausible sample, (n, n_asked,
    n_asked)."""
    gap: float
    """Share by which the typical relative bound may exceed that of the best sampling."""
    mixture: Mixture
    """The same readings as a mixture, of which a similar problem is solved faster."""


def best_sampling(
    rows: Array,
    capacity: Array,
    samples: int,
    criterion: Criterion,
    *,
    gap: float,
    most: int,
    before: Array | float = 0.0,
    start: Mixture | None = None,
    to_beat: float = np.inf,
    mixing: Mixing = ROUGH,
) -> Optimum:
    """Distribute readings over cells such that a criterion is minimal.

    Parameters
    ----------
    rows : (n, n_parameters, n_cells)
        Sensitivities of n plausible samples to their log-parameters, in units of the noise.
    capacity : (n_cells,)
        Largest number of readings in each cell.
    samples
        Number of readings, reduced to the total capacity if that is less.
    criterion
        Criterion to be minimized.
    gap
        Gap at which to stop.
    most
        Largest number of fillings.
    before : (n or 1, n_parameters, n_parameters)
        Information from earlier experiments.
    start
        Mixture of fillings of these cells to go on from; by default readings are even.
    to_beat
        Typical relative bound at which to stop when the best sampling cannot have it.
    mixing
        How far a mixture is improved.
    """
    room = min(float(samples), float(capacity.sum()))
    even = Mixture(fill_evenly(capacity, room)[None], np.ones(1))
    mixture = start.within(capacity, room) if start else even
    fillings, shares = list(mixture.fillings), mixture.shares
    known = np.stack([_information(rows, filling) for filling in fillings])
    sharpness = _KNOWN if start else _BLUNT
    best: Optimum | None = None
    for _ in range(most):
        information = np.tensordot(shares, known, 1)
        inverse = inverted(information + before)
        covariances, of_samples, sensitivity = compute_covariances(inverse, criterion, sharpness)
        worth = of_samples @ np.einsum("npc,npc->nc", sensitivity @ rows, rows)
        filling = fill(worth, capacity, room)
        reached = float(np.einsum("n,npq,npq->", of_samples, sensitivity, information))
        gain = float(worth @ filling) - reached
        missing = gap_of(criterion, covariances, gain, sharpness)
        if best is None or missing < best.gap:
            mixture = Mixture(np.array(fillings), shares)
            best = Optimum(shares @ mixture.fillings, covariances, missing, mixture)
        if missing < gap or criterion.typical_bound(covariances) > to_beat * (1 + missing):
            break
        fillings.append(filling)
        known = np.concatenate((known, _information(rows, filling)[None]))
        shares = np.append(shares * (1 - 1 / len(fillings)), 1 / len(fillings))
        sharpness = min(mixing.sharpest, sharpness * mixing.sharper)
        shares = _mixed(known, before, shares, criterion, sharpness, mixing)
        kept = shares > _DROPPED
        fillings = [one for one, keep in zip(fillings, kept, strict=True) if keep]
        known, shares = known[kept], shares[kept] / shares[kept].sum()
    assert best is not None
    return best


def least_bound(
    rows: Mapping[float, Sequence[Array]],
    capacity: Array,
    samples: Array,
    total: int,
    criterion: Criterion,
    before: Array | float = 0.0,
) -> float:
    """Return a typical relative bound that no sampling falls below.

    Parameters
    ----------
    rows : dict of float to sequences of (n, n_parameters, n_cells)
        Sensitivities at instants of each cell, by the share of its slots that each instant stands
        for; the first are those that `samples` was computed with.
    capacity : (n_cells,)
        Largest number of readings in each cell.
    samples : (n_cells,)
        A nearly optimal sampling, the nearer, the closer this is.
    total
        Number of readings.
    criterion, before
        As in `best_sampling`.
    """
    every = [(share, each) for share, several in rows.items() for each in several]
    information = _information(every[0][1], samples)
    inverse = inverted(information + before)
    room = np.concatenate([share * capacity for share, _ in every])
    missing = np.inf
    # Any power gives a bound.
    for sharpness in np.geomspace(_KNOWN, FINE.sharpest, _POWERS):
        covariances, of_samples, sensitivity = compute_covariances(inverse, criterion, sharpness)
        worth = np.concatenate(
            [of_samples @ np.einsum("npc,npc->nc", sensitivity @ each, each) for _, each in every]
        )
        filling = fill(worth, room, min(float(total), float(capacity.sum())))
        reached = float(np.einsum("n,npq,npq->", of_samples, sensitivity, information))
        gain = float(worth @ filling) - reached
        missing = min(missing, gap_of(criterion, covariances, gain, sharpness))
    return criterion.typical_bound(covariances) / (1 + missing)


def fill_evenly(capacity: Array, room: float) -> Array:
    """Distribute readings evenly over cells, within their capacity."""
    level = room / np.count_nonzero(capacity)
    for _ in range(20):
        filled = np.minimum(capacity, level)
        free = np.count_nonzero(capacity > level)
        if free == 0:
            break
        level += (room - filled.sum()) / free
    return np.minimum(capacity, level)


def fill(worth: Array, capacity: Array, room: float) -> Array:
    """Fill the cells of largest worth."""
    order = np.argsort(-worth, kind="stable")
    before = np.cumsum(capacity[order]) - capacity[order]
    filling = np.zeros_like(capacity)
    filling[order] = np.clip(room - before, 0.0, capacity[order])
    return filling


def _information(rows: Array, samples: Array) -> Array:
    """Return the Fisher information, (n, n_parameters, n_parameters)."""
    return (rows * samples) @ rows.swapaxes(1, 2)


def compute_covariances(
    inverse: Array, criterion: Criterion, sharpness: float
) -> tuple[Array, Array, Array]:
    """Return covariances of the parameters asked for, weights of samples, and of information."""
    columns = inverse[:, :, criterion.targets]
    covariances = columns[:, criterion.targets]
    of_samples, z = criterion.weights(covariances, sharpness)
    return covariances, of_samples, columns @ z @ columns.swapaxes(1, 2)


def gap_of(criterion: Criterion, covariances: Array, gain: float, sharpness: float) -> float:
    """Return the share by which the typical relative bound may exceed the best one.

    With weights pi and Z, sum pi tr(Z C) is convex, and nowhere larger than the criterion.
    """
    values = criterion.values(covariances)
    of_samples, z = criterion.weights(covariances, sharpness)
    count = len(criterion.targets)
    if criterion.name == "D":
        above = values.max() - of_samples @ values if criterion.over == "worst" else 0.0
        return float(np.expm1(0.5 * (gain + above) / count))
    now = float(values.max() if criterion.over == "worst" else values.mean())
    weighed = float(np.einsum("n,nab,nab->", of_samples, z, covariances))
    lowest = weighed - gain
    return float(np.sqrt(now / lowest) - 1) if lowest > 0 else np.inf


def _mixed(
    known: Array,
    before: Array | float,
    shares: Array,
    criterion: Criterion,
    sharpness: float,
    mixing: Mixing,
) -> Array:
    """Improve the shares of fillings, given their information, (n_fillings, n, p, p)."""
    flat = known.reshape(len(known), -1)

    def at(shares: Array) -> tuple[float, Callable[[], Array]]:
        inverse = inverted((shares @ flat).reshape(known.shape[1:]) + before)
        covariances = inverse[:, :, criterion.targets][:, criterion.targets]
        return criterion.smooth(covariances, sharpness), lambda: worth_of(inverse)

    def worth_of(inverse: Array) -> Array:
        _, of_samples, sensitivity = compute_covariances(inverse, criterion, sharpness)
        return np.einsum("n,npq,fnpq->f", of_samples, sensitivity, known)

    return improve_shares(shares, criterion, mixing, at)


def improve_shares(
    shares: Array,
    criterion: Criterion,
    mixing: Mixing,
    at: Callable[[Array], tuple[float, Callable[[], Array]]],
) -> Array:
    """Improve shares of fillings, by steps that only ever make the criterion smaller.

    Parameters
    ----------
    shares : (n_fillings,)
        Shares to begin with.
    criterion
        Criterion to be minimized.
    mixing
        When to stop.
    at
        Function of shares. It returns the criterion, and a function that computes what each filling
        is worth there, (n_fillings,).
    """
    power = 1.0 if criterion.name == "D" else 0.5
    value, worth_there = at(shares)
    # Of singular information, rounding errors may have any sign.
    worth = np.maximum(worth_there(), 0.0)
    for _ in range(mixing.tries):
        largest = worth.max()
        if not largest > 0:
            break
        tried = shares * (worth / largest) ** power
        tried /= tried.sum()
        new_value, worth_there = at(tried)
        if new_value <= value:
            decrease = value - new_value
            shares, value = tried, new_value
            if decrease < mixing.least_decrease:
                break
            worth = np.maximum(worth_there(), 0.0)
            power *= 1.2
        else:
            power *= 0.4
    return shares
