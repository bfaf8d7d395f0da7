"""The elements of samples: what any constitutive model comes down to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array


@dataclass(frozen=True)
class Network:
    """The elements of n samples.

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


# Of an element that is rigid, in N/m or N s/m: no response shows that it gives way.
_RIGID = 1e18


def columns_of(parameters: ArrayLike) -> Array:
    """Columns of parameters, (n, n_parameters), those that are infinite as good as rigid."""
    columns = np.atleast_2d(np.asarray(parameters) * 1.0).T
    rigid = np.isinf(columns)
    return np.where(rigid, _RIGID, columns) if np.any(rigid) else columns


MOST_BRANCHES = 8
"""More are too many for polynomials: those of a power law (`biogrip.experiment.springpot`)."""
