"""What an instrument adds to the rotation besides noise: an offset, and a drift linear in time.

Both enter linearly, so they are not searched for. Whatever a trace shares with
their span is taken out of trace and responses alike, and comes back as the
best offset and drift once the sample is known (variable projection).

References
----------
.. [1] G. H. Golub and V. Pereyra, The differentiation of pseudo-inverses and nonlinear least
   squares problems whose variables separate, SIAM Journal on Numerical Analysis 10 (1973),
   413-432.
"""

import numpy as np

from biogrip.arrays import Array


def nuisance_basis(time_s: Array, *, offset: bool, drift: bool) -> Array:
    """Return orthonormal functions of time that span offset and drift.

    Parameters
    ----------
    time_s : (n_times,)
        Sampling times.
    offset, drift
        Which of them the instrument may have.

    Returns
    -------
    (n_functions, n_times)
    """
    functions = [np.ones_like(time_s)] * offset + [time_s] * drift
    if not functions:
        return np.zeros((0, len(time_s)))
    return np.linalg.qr(np.stack(functions, axis=1))[0].T


def without(basis: Array, rows: Array) -> Array:
    """Take the span of a basis out of functions of time, shape (..., n_times)."""
    return rows - (rows @ basis.T) @ basis if len(basis) else rows


def within(basis: Array, rows: Array) -> Array:
    """Return what `without` takes out."""
    return (rows @ basis.T) @ basis
