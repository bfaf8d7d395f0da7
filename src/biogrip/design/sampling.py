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

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion, inverted

# Iterations that improve a mixture before a filling is added.
_MIXED = 15
# Power p of the p-norm that replaces a maximum: at first, its growth per round, in the end.
_BLUNT, _SHARPER, _SHARP = 10.0, 1.5, 1000.0
# A filling with less than this share of a mixture is dropped.
_DROPPED = 1e-9


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


def best_sampling(
    rows: Array,
    capacity: Array,
    samples: int,
    criterion: Criterion,
    *,
    gap: float,
    most: int,
    before: Array | float = 0.0,
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
    """
    room = min(float(samples), float(capacity.sum()))
    first = _even(capacity, room)
    fillings, shares = [first], np.ones(1)
    known = _information(rows, first)[None]
    best: Optimum | None = None
    for round_ in range(most):
        sharpness = min(_SHARP, _BLUNT * _SHARPER**round_)
        information = np.tensordot(shares, known, 1)
        inverse = inverted(information + before)
        covariances, of_samples, sensitivity = _covariances(inverse, criterion, sharpness)
        worth = np.einsum("n,npq,npc,nqc->c", of_samples, sensitivity, rows, rows, optimize=True)
        filling = _filled(worth, capacity, room)
        reached = float(np.einsum("n,npq,npq->", of_samples, sensitivity, information))
        gain = float(worth @ filling) - reached
        missing = _gap(criterion, covariances, gain, sharpness)
        if best is None or missing < best.gap:
            mean_samples = np.tensordot(shares, np.array(fillings), 1)
            best = Optimum(mean_samples, covariances, missing)
        if missing < gap:
            break
        fillings.append(filling)
        known = np.concatenate((known, _information(rows, filling)[None]))
        shares = np.append(shares * (1 - 1 / len(fillings)), 1 / len(fillings))
        shares = _mixed(known, before, shares, criterion, sharpness)
        kept = shares > _DROPPED
        fillings = [one for one, keep in zip(fillings, kept, strict=True) if keep]
        known, shares = known[kept], shares[kept] / shares[kept].sum()
    assert best is not None
    return best


def _even(capacity: Array, room: float) -> Array:
    """Distribute readings evenly over cells, within their capacity."""
    level = room / np.count_nonzero(capacity)
    for _ in range(20):
        filled = np.minimum(capacity, level)
        free = np.count_nonzero(capacity > level)
        if free == 0:
            break
        level += (room - filled.sum()) / free
    return np.minimum(capacity, level)


def _filled(worth: Array, capacity: Array, room: float) -> Array:
    """Fill the cells of largest worth."""
    order = np.argsort(-worth, kind="stable")
    before = np.cumsum(capacity[order]) - capacity[order]
    filling = np.zeros_like(capacity)
    filling[order] = np.clip(room - before, 0.0, capacity[order])
    return filling


def _information(rows: Array, samples: Array) -> Array:
    """Return the Fisher information, (n, n_parameters, n_parameters)."""
    return (rows * samples) @ rows.swapaxes(1, 2)


def _covariances(
    inverse: Array, criterion: Criterion, sharpness: float
) -> tuple[Array, Array, Array]:
    """Return covariances of the parameters asked for, weights of samples, and of information."""
    columns = inverse[:, :, criterion.targets]
    covariances = columns[:, criterion.targets]
    of_samples, z = criterion.weights(covariances, sharpness)
    return covariances, of_samples, columns @ z @ columns.swapaxes(1, 2)


def _gap(criterion: Criterion, covariances: Array, gain: float, sharpness: float) -> float:
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
    known: Array, before: Array | float, shares: Array, criterion: Criterion, sharpness: float
) -> Array:
    """Improve the shares of fillings, given their information, (n_fillings, n, p, p)."""
    flat = known.reshape(len(known), -1)

    def at(shares: Array) -> tuple[Array, float]:
        inverse = inverted((shares @ flat).reshape(known.shape[1:]) + before)
        covariances = inverse[:, :, criterion.targets][:, criterion.targets]
        return inverse, criterion.smooth(covariances, sharpness)

    def worth_of(inverse: Array) -> Array:
        _, of_samples, sensitivity = _covariances(inverse, criterion, sharpness)
        return np.einsum("n,npq,fnpq->f", of_samples, sensitivity, known)

    power = 1.0 if criterion.name == "D" else 0.5
    inverse, value = at(shares)
    worth = worth_of(inverse)
    for _ in range(_MIXED):
        tried = shares * (worth / worth.max()) ** power
        tried /= tried.sum()
        inverse, new_value = at(tried)
        if new_value <= value:
            shares, value, worth = tried, new_value, worth_of(inverse)
            power *= 1.2
        else:
            power *= 0.4
    return shares
