"""Networks of springs and dampers, the common form of all constitutive models."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array


@dataclass(frozen=True)
class Network:
    """Springs and dampers of n samples.

    Parameters
    ----------
    k_p, c_p : (n,)
        Parallel spring (N/m) and damper (N s/m).
    k, c : (n, n_branches)
        Spring and damper of each Maxwell branch.
    """

    k_p: Array
    c_p: Array
    k: Array
    c: Array


# Stiffness or damping of a rigid element, in N/m or N s/m, too large to affect a response.
_RIGID = 1e18


def columns_of(parameters: ArrayLike) -> Array:
    """Return columns of parameters, (n, n_parameters), with infinite ones replaced by rigid."""
    columns = np.atleast_2d(np.asarray(parameters) * 1.0).T
    rigid = np.isinf(columns)
    return np.where(rigid, _RIGID, columns) if np.any(rigid) else columns


MOST_BRANCHES = 8
"""Most branches for which polynomials are used; springpots have more of them."""
