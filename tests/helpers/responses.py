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

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, ctx

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
        return _solution(gripper, [arb(float(value)) for value in parameters], steps, time_s)


def _solution(gripper: Gripper, parameters: Sequence[arb], steps: Course, time_s: Array) -> Array:
    k, k_p, c, c_p = parameters
    b = arb(gripper.arm_length_m) * (arb(gripper.reference_angle_deg) / 180).sin_pi()
    inertia, damping, stiffness = (
        [arb(getattr(arm, name)) for arm in (gripper.left, gripper.right)]
        for name in ("inertia_kgm2", "damping_Nms_per_rad", "stiffness_Nm_per_rad")
    )
    # State: phi_2, phi_4, their rates, and the node x between spring k and damper c.
    # Force on each tip: k (b phi_2 - x) + k_p delta + c_p delta', delta = b (phi_2 + phi_4).
    force = [(k + k_p) * b, k_p * b, c_p * b, c_p * b, -k]
    moments = [[b * each for each in force] for _ in range(2)]
    for arm, own in enumerate(moments):
        own[arm] += stiffness[arm]
        own[2 + arm] += damping[arm]
    arms = [[-each / of for each in own] for own, of in zip(moments, inertia, strict=True)]
    # k (u_B - x) = c (x' - u_C'), u_B = b phi_2, u_C = -b phi_4.
    node: list[Any] = [k / c * b, 0, 0, -b, -k / c]
    a = acb_mat([[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], *arms, node])
    rates, vectors = a.eig(right=True)
    seen = acb_mat([[1, 0, 0, 0, 0], force])
    of_modes = seen * vectors
    found = [[acb(0)] * len(time_s) for _ in range(2)]
    for start, height in zip(steps.time_s, steps.changes[:, 0], strict=True):
        load = acb_mat(5, 1)
        load[2, 0], load[3, 0] = (arb(float(height)) / own for own in inertia)
        rest = a.solve(-load)
        weights, settled = vectors.solve(-rest), seen * rest
        for i, t in enumerate(time_s):
            elapsed = arb(float(t)) - arb(float(start))
            if elapsed >= 0:
                fading = [[weights[j, 0] * (rates[j] * elapsed).exp()] for j in range(5)]
                now = settled + of_modes * acb_mat(fading)
                for row in range(2):
                    found[row][i] += now[row, 0]
    return np.array([_checked([value.real for value in own]) for own in found])


def _checked(values: Sequence[arb]) -> Array:
    """As doubles, of what is known to 50 digits of the largest."""
    both = np.array([(float(value.mid()), float(value.rad())) for value in values])
    middle, radius = both.T
    assert radius.max() < 1e-50 * np.abs(middle).max()
    return middle


def log_range(model: SampleModel) -> tuple[Array, Array]:
    low, high = zip(*(LOG_RANGES[parameter.kind] for parameter in model.parameters), strict=True)
    return np.array(low), np.array(high)


def random_samples(count: int, seed: int) -> Array:
    """Chromosomes drawn uniformly from the whole search range (k, k_p, c, c_p)."""
    rng = np.random.default_rng(seed)
    exponent = rng.integers([-3, -3, -4, -4], [8, 8, 5, 5], size=(count, 4), endpoint=True)
    first, second = rng.integers(1, 9, size=(2, count, 4), endpoint=True)
    return 10.0**exponent * (0.1 * first + 0.01 * second)
