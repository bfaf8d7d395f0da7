"""Nuisance functions that an instrument adds to the rotation: an offset and a linear drift.

Their amplitudes are linear parameters and are not searched: their span is projected out of trace
and responses alike, which is the same as fitting them (variable projection) [1]_. Functions whose
amplitude has a known standard deviation are projected out in part [2]_.

References
----------
.. [1] G. H. Golub and V. Pereyra, The differentiation of pseudo-inverses and nonlinear least
   squares problems whose variables separate, SIAM Journal on Numerical Analysis 10 (1973),
   413-432.
.. [2] A. M. Stuart, Inverse problems: a Bayesian perspective, Acta Numerica 19 (2010), 451-559:
   a marginalised Gaussian uncertainty is a part of the noise.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import TorqueHistory

# Least squared norm of a function that is projected out completely, up to rounding.
_WHOLE = 1 - 1e-9


def nuisance_basis(time_s: Array, *, offset: bool, drift: bool) -> Array:
    """Return orthonormal functions of time, (n_functions, n_times), that span offset and drift."""
    functions = [np.ones_like(time_s)] * offset + [time_s] * drift
    if not functions:
        return np.zeros((0, len(time_s)))
    return np.linalg.qr(np.stack(functions, axis=1))[0].T


def without(basis: Array, rows: Array) -> Array:
    """Project the span of a basis out of functions of time, shape (..., n_times)."""
    return rows - (rows @ basis.T) @ basis if len(basis) else rows


def within(basis: Array, rows: Array, sd: Array | None = None) -> Array:
    """Project functions of time, shape (..., n_times), on the span of a basis.

    With standard deviations of the values, (n_times,), by weighted least squares.
    """
    if sd is None or not len(basis):
        return (rows @ basis.T) @ basis
    weighted = np.linalg.qr((basis / sd).T)[0].T
    return within(weighted, rows / sd) * sd


def with_uncertain(basis: Array, functions: Array) -> Array:
    """Add functions of random amplitude to a basis, so that `without` whitens noise with them.

    Parameters
    ----------
    basis : (n_basis, n_times)
        Orthonormal functions, of any amplitude.
    functions : (n_functions, n_times)
        Functions times the standard deviation of their amplitude, over that of white noise.

    Returns
    -------
    (n_basis + n_functions, n_times)
        Orthogonal functions of norm one and less. With singular values s of the functions,
        `without` removes the part 1 - 1/sqrt(1 + s^2) of each direction, so that the sum of
        noise and functions becomes white noise.
    """
    rest = without(basis, functions)
    _, sizes, directions = np.linalg.svd(rest, full_matrices=False)
    shares = 1 - 1 / np.sqrt(1 + sizes**2)
    return np.vstack((basis, np.sqrt(shares)[:, None] * directions))


def taken_out(basis: Array) -> int:
    """Count the functions of a basis that are projected out completely."""
    return int(np.count_nonzero(np.sum(np.square(basis), axis=1) > _WHOLE))


# A lag of so many protocols is an integral of the torque.
_LAG = 1e6
# Share of a drift's variance that must be no flow: below it, lines differ by less than a tenth.
_TELLING = 0.01


def drift_is_flow(torque: TorqueHistory, time_s: Array) -> bool:
    """Return True if a drift looks like the flow of a damper without a spring.

    Under a constant load both are the same line. Under a deformation nothing flows on.

    Parameters
    ----------
    torque
        The protocol.
    time_s : (n_samples,)
        Sampling times.
    """
    if torque.deforms:
        return False
    constant = nuisance_basis(time_s, offset=True, drift=False)
    flows = without(constant, _LAG * lagged_torques(torque, (_LAG,))(time_s))
    drift = without(constant, time_s / torque.end_s)
    basis = np.linalg.qr(flows.T)[0].T
    return bool(np.sum(without(basis, drift) ** 2) < _TELLING * np.sum(drift**2))
