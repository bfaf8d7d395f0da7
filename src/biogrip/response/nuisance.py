"""What an instrument adds to the rotation besides noise: an offset, and a drift linear in time.

Both enter linearly, so they are not searched for. Whatever a trace shares with
their span is taken out of trace and responses alike, and comes back as the
best offset and drift once the sample is known (variable projection) [1]_. What is
known to enter, but only with about some amplitude, is taken out in part [2]_.

References
----------
.. [1] G. H. Golub and V. Pereyra, The differentiation of pseudo-inverses and nonlinear least
   squares problems whose variables separate, SIAM Journal on Numerical Analysis 10 (1973),
   413-432.
.. [2] A. M. Stuart, Inverse problems: a Bayesian perspective, Acta Numerica 19 (2010), 451-559:
   what is uncertain with a Gaussian prior, marginalised, is a part of the noise.
"""

import numpy as np

from biogrip.arrays import Array

# Squared norm of a function that is taken out whole, but for rounding.
_WHOLE = 1 - 1e-9


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


def with_uncertain(basis: Array, functions: Array) -> Array:
    """Add to a basis what a trace may contain with an amplitude of about one standard deviation.

    Parameters
    ----------
    basis : (n_basis, n_times)
        Orthonormal functions, of any amplitude.
    functions : (n_functions, n_times)
        For each, a standard deviation's worth of it, in units of that of white noise.

    Returns
    -------
    (n_basis + n_functions, n_times)
        Orthogonal functions of norm one and less. What `without` leaves of noise and functions
        together is white noise: with singular values s of the functions, the part
        1 - 1/sqrt(1 + s^2) of each direction is taken out.
    """
    rest = without(basis, functions)
    _, sizes, directions = np.linalg.svd(rest, full_matrices=False)
    shares = 1 - 1 / np.sqrt(1 + sizes**2)
    return np.vstack((basis, np.sqrt(shares)[:, None] * directions))


def taken_out(basis: Array) -> int:
    """Count the functions of a basis that are taken out whole."""
    return int(np.count_nonzero(np.sum(np.square(basis), axis=1) > _WHOLE))
