"""Concentration of readings in few cells without loss of information.

All distributions of readings with the same information form a polytope. At its vertices, no more
cells are filled in part than there are numbers in the information (Caratheodory). A linear program
finds the vertex with the earliest readings after each step.

References
----------
.. [1] H. P. Wynn, Optimum submeasures with applications to finite population sampling, in
   Statistical Decision Theory and Related Topics III, vol. 2 (1982), 485-495.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import whitened

# Share by which the information may change in any direction.
_AS_GOOD = 1e-5


def in_few_bins(
    sensitivity: Array, samples: Array, capacity: Array, cost: Array, before: Array | float = 0.0
) -> Array:
    """Distribute readings over few cells, (n_cells,), with the same sum and information.

    Sensitivities, capacity and information before are those of `best_sampling`; each cell has a
    given number of readings and a cost. Those given are returned if the linear program fails.
    """
    from scipy.optimize import linprog

    information = (sensitivity * samples) @ sensitivity.swapaxes(1, 2) + before
    white = whitened(information, sensitivity)
    first, second = np.triu_indices(sensitivity.shape[1])
    rows = (white[:, first] * white[:, second]).reshape(-1, sensitivity.shape[2])
    inputs = rows @ samples
    # In units of all readings, so that numbers are near one.
    total = samples.sum()
    upper = np.minimum(capacity / total, 1.0)
    found = linprog(
        cost,
        A_ub=np.concatenate((rows, -rows)) * total,
        b_ub=np.concatenate((inputs + _AS_GOOD, -inputs + _AS_GOOD)),
        A_eq=np.ones((1, len(samples))),
        b_eq=np.ones(1),
        bounds=np.stack((np.zeros_like(upper), upper), axis=1),
        method="highs-ds",
    )
    if found.x is None:
        return samples
    return found.x * total
