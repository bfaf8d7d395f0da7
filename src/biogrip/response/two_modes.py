"""Closed form of the linear model with two modes: equal arms, one Maxwell branch, no inertia.

This special case of `biogrip.response.linear` is written out for speed: populations of the
genetic algorithm are small, and most time goes into calls.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Arm
from biogrip.response.roots import real_quadratic_roots


def two_modes(arm: Arm, lever_m: float, network: Network) -> tuple[Array, Array, Array]:
    """Compute the response of either of two equal arms to a unit step of both torques.

    Returns
    -------
    static : (n,)
        Final rotation in rad per N m.
    rates : (2, n)
        Exponents in 1/s.
    weights : (2, n)
        Weights of the exponentials, in rad per N m.
    """
    k_p, c_p, c = network.k_p, network.c_p, network.c[:, 0]
    relaxation_s = c / network.k[:, 0]
    coupling = 2 * lever_m**2
    stiffness, damping = arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad
    # The denominator Z Q + 2 b^2 P, ascending powers.
    denominator = np.empty((3, len(k_p)))
    denominator[0] = coupling * k_p + stiffness
    denominator[1] = coupling * (k_p * relaxation_s + c_p + c) + (
        stiffness * relaxation_s + damping
    )
    denominator[2] = (coupling * c_p + damping) * relaxation_s
    rates = real_quadratic_roots(denominator.T).T
    slope = denominator[2] * (rates[0] - rates[1])
    weights = (1 + relaxation_s * rates) / (rates * slope)
    np.negative(weights[1], out=weights[1])
    return 1 / denominator[0], rates, weights
