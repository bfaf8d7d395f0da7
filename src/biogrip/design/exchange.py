"""Exchange of single readings between cells, for rounding has changed what they tell.

References
----------
.. [1] V. V. Fedorov, Theory of Optimal Experiments, Academic Press, 1972, chapter 3.
"""

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.design.criteria import Criterion, inverted

# Cells that give a reading and cells that take one which are tried, most exchanges, and the least
# share by which the typical relative bound decreases with each.
_TRIED, _MOST, _BETTER = 16, 400, 1e-7
# Power of the p-norm that replaces a maximum where cells are chosen.
_SHARPNESS = 100.0


def exchanged(
    rows: Array,
    counts: IntArray,
    samples: Array,
    capacity: Array,
    criterion: Criterion,
    before: Array | float = 0.0,
) -> IntArray:
    """Move readings one after the other while the criterion decreases.

    Rows, capacity and information before are those of `best_sampling`. The numbers of readings were
    rounded from `samples`, (n_cells,); they go to cells that had any, and to their neighbours.
    """
    counts = counts.copy()
    near = np.convolve(samples > 0, np.ones(3), mode="same") > 0
    places = np.flatnonzero(near)
    own, room = rows[:, :, places], capacity[places]
    information = (own * counts[places]) @ own.swapaxes(1, 2) + before
    targets = np.array(criterion.targets)
    lowest = criterion.typical_bound(inverted(information)[:, targets[:, None], targets])
    for _ in range(_MOST):
        inverse = inverted(information)
        of_samples, z = criterion.weights(inverse[:, targets[:, None], targets], _SHARPNESS)
        columns = inverse[:, :, targets]
        worth = of_samples @ np.einsum(
            "npc,npc->nc", columns @ z @ columns.swapaxes(1, 2) @ own, own
        )
        here = counts[places]
        giving = _first(worth, here > 0)
        taking = _first(-worth, here + 1 <= room)
        if not len(giving) or not len(taking):
            break
        changed = (
            information[None, None]
            - _squares(own[:, :, giving])[:, None]
            + _squares(own[:, :, taking])[None, :]
        )
        flat = changed.reshape(-1, *information.shape)
        inverses = inverted(flat.reshape(-1, *information.shape[1:])).reshape(flat.shape)
        bounds = criterion.typical_bounds(inverses[:, :, targets[:, None], targets])
        best = int(np.argmin(bounds))
        if not bounds[best] < lowest * (1 - _BETTER):
            break
        give, take = np.unravel_index(best, (len(giving), len(taking)))
        counts[places[giving[give]]] -= 1
        counts[places[taking[take]]] += 1
        information, lowest = flat[best], float(bounds[best])
    return counts


def _first(order: Array, allowed: BoolArray) -> IntArray:
    """Return the indices that are allowed of the lowest numbers."""
    there = np.flatnonzero(allowed)
    return there[np.argsort(order[there], kind="stable")[:_TRIED]]


def _squares(rows: Array) -> Array:
    """Return the information of one reading in each cell, (n_cells, n, p, p)."""
    return np.einsum("npc,nqc->cnpq", rows, rows)
