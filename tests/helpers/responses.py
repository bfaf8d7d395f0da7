"""Protocols and samples to try, and an independent solution with 50 digits.

Of the corrected linear model's solution nothing is shared with the library: forces of
springs and dampers are written down arm by arm, as in the corrected eqs. (4)-(6), and the
five first-order equations solved through the eigenvectors of their matrix. That is done with
balls, which hold the exact value whatever is rounded, so that how far it is known is known, too.

References
----------
.. [1] F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE
   Transactions on Computers 66 (2017), 1281-1292.
"""

from typing import Any

import numpy as np
from flint import acb_mat, arb, ctx

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course, Phase, hold
from biogrip.physics.sample_model import SampleModel

PROTOCOLS = {
    "steps": (hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)),
    "ramps and parabola": (
        Phase(50.0, 0.0, 2e-11),
        Phase(150.0, 1e-9, 1e-12, 1e-14),
        Phase(200.0, 1.4e-9, -4e-12),
    ),
}
# Logarithms between which parameters of each kind are searched for, about.
LOG_RANGES = {
    "stiffness": (-9.1, 18.4),
    "springpot": (-9.1, 18.4),
    "damping": (-11.4, 11.5),
    "exponent": (-4.5, -0.01),
}
SAMPLING_TIMES = {
    "uniform": np.linspace(0.0, 400.0, 4001),
    "uneven": np.sort(np.random.default_rng(2).uniform(0.0, 400.0, 1500)),
    "few": np.array([0.0, 1.0, 5.0, 20.0, 199.0, 201.0, 210.0, 390.0]),
}
# Worked with, of which sums of modes and their weights cost up to 60.
_DIGITS = 120


def exact_50_digits(gripper: Gripper, parameters: Array, steps: Course, time_s: Array) -> Array:
    """phi_2, and the force of springs and dampers on the tips in N, (2, n_times), with inertia.

    Of one sample (k, k_p, c, c_p).
    """
    with ctx.workdps(_DIGITS):
        k, k_p, c, c_p = (arb(float(value)) for value in parameters)
        b = arb(gripper.arm_length_m) * (arb(gripper.reference_angle_deg) / 180).sin_pi()
        # State: phi_2, phi_4, their rates, the node x between spring k and damper c, and 1.
        # Force on each tip: k (b phi_2 - x) + k_p delta + c_p delta', delta = b (phi_2 + phi_4).
        force: list[Any] = [(k + k_p) * b, k_p * b, c_p * b, c_p * b, -k, 0]
        arms = []
        for which, arm in enumerate((gripper.left, gripper.right)):
            moments: list[Any] = [*(-b * each for each in force[:5]), arb(1)]
            moments[which] -= arm.stiffness_Nm_per_rad
            moments[2 + which] -= arm.damping_Nms_per_rad
            arms.append([each / arm.inertia_kgm2 for each in moments])
        # k (u_B - x) = c (x' - u_C'), u_B = b phi_2, u_C = -b phi_4.
        node: list[Any] = [k / c * b, 0, 0, -b, -k / c, 0]
        a = acb_mat([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], *arms, node, [0] * 6])
        rates, vectors = a.eig(right=True)
        loads = [*zip(map(arb, steps.time_s), map(arb, steps.changes[:, 0]), strict=True)]
        sums = [
            [sum(load * ((t - at) * rate).exp() for at, load in loads if t >= at) for t in time_s]
            for rate in rates
        ]
        weights = vectors.solve(acb_mat([[0]] * 5 + [[1]]))
        shown = acb_mat([[1, 0, 0, 0, 0, 0], force]) * vectors
        for row, weight in enumerate(weights.entries()):
            sums[row] = [weight * each for each in sums[row]]
        found = [value.real for value in (shown * acb_mat(sums)).entries()]
    middle, radius = np.array([(float(it.mid()), float(it.rad())) for it in found]).T
    assert radius.max() < 1e-50 * np.abs(middle).reshape(2, -1).max(axis=1).min()
    return middle.reshape(2, -1)


def log_range(model: SampleModel) -> tuple[Array, Array]:
    low, high = zip(*(LOG_RANGES[parameter.kind] for parameter in model.parameters), strict=True)
    return np.array(low), np.array(high)


def random_samples(count: int, seed: int) -> Array:
    """Chromosomes drawn uniformly from the whole search range (k, k_p, c, c_p)."""
    rng = np.random.default_rng(seed)
    exponent = rng.integers([-3, -3, -4, -4], [8, 8, 5, 5], size=(count, 4), endpoint=True)
    first, second = rng.integers(1, 9, size=(2, count, 4), endpoint=True)
    return 10.0**exponent * (0.1 * first + 0.01 * second)
