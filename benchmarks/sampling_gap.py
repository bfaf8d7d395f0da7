"""How good a sampling is, whoever found it."""

import numpy as np

from biogrip.arrays import Array


def feasible(samples: Array, capacity: Array, count: int) -> Array:
    """Put an answer within its limits, which solvers keep to only nearly, (n_cells,)."""
    within = np.clip(samples, 0.0, capacity)
    return within * min(1.0, count / within.sum())


def typical_bound(told: Array, samples: Array, criterion: str) -> float:
    """Typical relative bound: root of the mean square, or of the determinant's p-th root.

    Parameters
    ----------
    told : (n_parameters, n_cells)
        Sensitivities in units of the noise.
    samples : (n_cells,)
        Readings in each.
    criterion
        D or A.
    """
    information = (told * samples) @ told.T
    if criterion == "D":
        return float(np.exp(-0.5 * np.linalg.slogdet(information)[1] / len(told)))
    return float(np.sqrt(np.trace(np.linalg.inv(information)) / len(told)))


def gap_of(told: Array, capacity: Array, samples: Array, criterion: str) -> float:
    """By what share the typical bound may exceed the best, from the gradient at an answer.

    Both criteria are convex: log det M^-1, or tr M^-1, is nowhere lower than on its tangent, and
    there lowest where the cells are full that tell most.
    """
    inverse = np.linalg.inv((told * samples) @ told.T)
    root = inverse if criterion == "D" else inverse @ inverse
    worth = np.einsum("pc,pq,qc->c", told, root, told)
    order = np.argsort(-worth)
    before = np.cumsum(capacity[order]) - capacity[order]
    filling = np.clip(samples.sum() - before, 0.0, capacity[order])
    gain = float(worth[order] @ filling - worth @ samples)
    if criterion == "D":
        return float(np.expm1(0.5 * gain / len(told)))
    now = float(np.trace(inverse))
    return float(np.sqrt(now / (now - gain)) - 1) if gain < now else np.inf
