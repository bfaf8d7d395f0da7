"""The same information from readings in few cells: all of a cell's readings, or none.

Of all ways to spread readings over cells that tell as much, one in a corner of their polytope has
no more cells filled in part than there are numbers in the information (Caratheodory). A linear
program finds it, the one with the earliest readings after each step.

References
----------
.. [1] H. P. Wynn, Optimum submeasures with applications to finite population sampling, in
   Statistical Decision Theory and Related Topics III, vol. 2 (1982), 485-495.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import whitened

# By which the information may differ, as a share of what it is in any direction.
_AS_GOOD = 1e-3


def in_few_cells(
    told: Array, samples: Array, capacity: Array, cost: Array, before: Array | float = 0.0
) -> Array:
    """Spread samples over few cells, without telling less.

    Parameters
    ----------
    told : (n, n_parameters, n_cells)
        Sensitivities in units of the noise.
    samples : (n_cells,)
        How they are spread.
    capacity : (n_cells,)
        How many a cell has room for.
    cost : (n_cells,)
        What a sample costs there.
    before : (n or 1, n_parameters, n_parameters)
        Information that is there already.

    Returns
    -------
    (n_cells,)
        As many in all; as given if no other way was found.
    """
    from scipy.optimize import linprog

    information = (told * samples) @ told.swapaxes(1, 2) + before
    white = whitened(information, told)
    first, second = np.triu_indices(told.shape[1])
    rows = (white[:, first] * white[:, second]).reshape(-1, told.shape[2])
    wanted = rows @ samples
    # In units of all samples, that numbers are near one.
    total = samples.sum()
    upper = np.minimum(capacity / total, 1.0)
    found = linprog(
        cost,
        A_ub=np.concatenate((rows, -rows)) * total,
        b_ub=np.concatenate((wanted + _AS_GOOD, -wanted + _AS_GOOD)),
        A_eq=np.ones((1, len(samples))),
        b_eq=np.ones(1),
        bounds=np.stack((np.zeros_like(upper), upper), axis=1),
        method="highs-ds",
    )
    if found.x is None:
        return samples
    spread: Array = found.x * total
    return spread
