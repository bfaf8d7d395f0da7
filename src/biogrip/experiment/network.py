"""Networks of springs and dampers, the common form of all constitutive models."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array


@dataclass(frozen=True)
class Network:
    """Springs and dampers of n samples."""

    k_p: Array
    """Parallel spring in N/m, (n,)."""
    c_p: Array
    """Parallel damper in N s/m, (n,)."""
    k: Array
    """Spring of each Maxwell branch in N/m, (n, n_branches)."""
    c: Array
    """Damper of each Maxwell branch in N s/m, (n, n_branches)."""


# Stiffness or damping of a rigid element, in N/m or N s/m, too large to affect a response.
_RIGID = 1e18


def columns_of(parameters: ArrayLike) -> Array:
    """Return columns of parameters, (n, n_parameters), with infinite ones replaced by rigid."""
    columns = np.atleast_2d(np.asarray(parameters) * 1.0).T
    rigid = np.isinf(columns)
    return np.where(rigid, _RIGID, columns) if np.any(rigid) else columns


def complex_modulus(network: Network, omega: Array) -> tuple[Array, Array]:
    """Return storage and loss moduli of n samples, in N/m or Pa, each (n, n_omega).

    Angular frequencies are in rad/s, (n_omega,).
    """
    rates = (network.k / network.c)[:, :, None]
    share = network.k[:, :, None] / (omega**2 + rates**2)
    storage = network.k_p[:, None] + np.sum(share * omega**2, axis=1)
    loss = network.c_p[:, None] * omega + np.sum(share * omega * rates, axis=1)
    return storage, loss


MOST_BRANCHES = 8
"""Most branches for which polynomials are used; springpots have more of them."""
