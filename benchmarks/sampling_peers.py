"""The best sampling of a torque as CVXPY is asked for it."""

import cvxpy as cp
import numpy as np

from biogrip.arrays import Array

# Steps of 0.99, Clarabel's own, end without an answer for determinants.
_SHORTER = 0.9


def by_cvxpy(told: Array, capacity: Array, samples: int, criterion: str) -> tuple[Array, float]:
    """Spread samples over cells by Clarabel, as a cone program.

    Parameters
    ----------
    told : (n_parameters, n_cells)
        Sensitivities in units of the noise.
    capacity : (n_cells,)
        How many samples a cell has room for.
    samples
        How many there are.
    criterion
        D or A.

    Returns
    -------
    samples : (n_cells,)
        How many each has; not whole.
    solver_s
        What the solver itself took.
    """
    count = len(told)
    # More than all samples does not fall into any cell.
    capacity = np.minimum(capacity, samples)
    even = samples / capacity.sum() * capacity
    root = np.linalg.cholesky((told * even) @ told.T)
    # With even readings, the information is the unit matrix.
    white = np.linalg.solve(root, told) * np.sqrt(capacity)
    products = (white[:, None] * white[None]).reshape(count**2, -1)
    filled = cp.Variable(len(capacity), nonneg=True)
    information = cp.reshape(products @ filled, (count, count), order="C")
    if criterion == "D":
        aim = cp.Maximize(cp.log_det(information))
    else:
        rows = np.linalg.inv(root).T
        rows /= np.linalg.norm(rows)
        aim = cp.Minimize(sum(cp.matrix_frac(row, information) for row in rows))
    limits = [filled <= 1, (capacity / samples) @ filled == 1]
    problem = cp.Problem(aim, limits)
    problem.solve(solver=cp.CLARABEL, max_step_fraction=_SHORTER)
    found: Array = capacity * np.asarray(filled.value)
    return found, float(problem.solver_stats.solve_time)
