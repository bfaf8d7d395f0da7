"""The elements of samples: what any constitutive model comes down to."""

from dataclasses import dataclass

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


MOST_BRANCHES = 8
"""More are too many for polynomials: those of a power law (`biogrip.experiment.springpot`)."""
