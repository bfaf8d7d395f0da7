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
_AS_GOOD = 1e-3


def in_few_bins(
    sensitivity: Array, samples: Array, capacity: Array, cost: Array, before: Array | float = 0.0
) -> Array:
    """Distribute readings over few cells, with the same information.

    Parameters
    ----------
    sensitivity : (n, n_parameters, n_cells)
        Sensitivities in units of the noise.
    samples : (n_cells,)
        Given numbers of readings in cells.
    capacity : (n_cells,)
        Largest number of readings in each cell.
    cost : (n_cells,)
        Cost of a reading in each cell.
    before : (n or 1, n_parameters, n_parameters)
        Information from earlier experiments.

    Returns
    -------
    (n_cells,)
        Numbers of readings with the same sum; those given if the linear program fails.
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
