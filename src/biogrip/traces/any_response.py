"""Responses to a protocol that a gripper may have with any sample, from lagged torques.

References
----------
.. [1] C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, Prentice-Hall, 1974,
   chapter 23: non-negative least squares.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper


def extreme_responses(lagged: Array, gripper: Gripper, lags: int) -> Array:
    """Return extreme responses, (n, n_rows), of which all samples' are non-negative combinations.

    A sample turns the left arm by phi_2 = tau_2/k_2 - x (tau_2/k_2 - (tau_2 - tau_4)/(k_2 + k_4)),
    where x is the sample's rigidity and decreases, as it relaxes, from at most 1 to at least 0.
    The extremes are: no sample, rigid ones that relax with one of the lags, and a rigid one.

    Parameters
    ----------
    lagged : (n_lagged, n_rows)
        Torques from `lagged_torques`; the shortest lag is negligible.
    gripper
        The gripper.
    lags
        Number of lags.
    """
    k_2, k_4 = gripper.left.stiffness_Nm_per_rad, gripper.right.stiffness_Nm_per_rad
    alone = lagged[:lags] / k_2
    if len(lagged) == lags:
        return alone
    pushed = lagged[lags:] / (k_2 + k_4)
    return np.vstack((alone - pushed + pushed[0], pushed[0]))


def left_over(trace: Array, responses: Array) -> float:
    """Return the residual sum of squares of a non-negative least-squares fit of the responses."""
    from scipy.optimize import nnls

    scale = np.linalg.norm(responses, axis=1)
    scaled = scale > 0
    if not np.any(scaled):
        return float(trace @ trace)
    return float(nnls((responses[scaled] / scale[scaled, None]).T, trace)[1] ** 2)
