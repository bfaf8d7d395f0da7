"""Samples without the library: impedances drawn by hand, and inversion by Talbot.

References
----------
.. [1] J. Abate and P. P. Valkó, Multi-precision Laplace transform inversion, International Journal
   for Numerical Methods in Engineering 60 (2004), 979-993: the fixed Talbot method.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from flint import acb, arb, ctx

from biogrip.arrays import Array
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course

Impedance = Callable[[Any], Any]
_NODES = 45


def series(*impedances: Any) -> Any:
    """Elements behind one another: compliances add."""
    return 1 / sum(1 / impedance for impedance in impedances)


IMPEDANCES: dict[str, Callable[..., Any]] = {
    "generalized_maxwell": lambda s, k, k_p, c, c_p: k_p + c_p * s + series(k, c * s),
    "liquid_drop": lambda s, k, k_p, c: k_p + series(k, c * s),
    "damper": lambda s, c_p: c_p * s,
    "kelvin_voigt": lambda s, k_p, c_p: k_p + c_p * s,
    "maxwell": lambda s, k, c: series(k, c * s),
    "zener_maxwell": lambda s, k, k_p, c: k_p + series(k, c * s),
    "zener_kelvin": lambda s, k_s, k_v, c_v: series(k_s, k_v + c_v * s),
    "burgers": lambda s, k_s, c_s, k_v, c_v: series(k_s, c_s * s, k_v + c_v * s),
    "springpot": lambda s, v, a: v * s**a,
    "fractional_kelvin_voigt": lambda s, k_p, v, a: k_p + v * s**a,
    "springpot_beside_damper": lambda s, v, a, c_p: v * s**a + c_p * s,
    "springpots_in_parallel": lambda s, v, a, g, b: v * s**a + g * s**b,
    "fractional_maxwell": lambda s, v, a, c: series(v * s**a, c * s),
    "fractional_maxwell_gel": lambda s, k, v, a: series(k, v * s**a),
    "springpots_in_series": lambda s, v, a, g, b: series(v * s**a, g * s**b),
    "fractional_zener": lambda s, k, k_p, v, a: k_p + series(k, v * s**a),
    "fractional_solid": lambda s, k_p, v, a, c: k_p + series(v * s**a, c * s),
    "fractional_jeffreys": lambda s, v, a, c, c_p: c_p * s + series(v * s**a, c * s),
}
"""Load over deformation of every model in the Laplace domain, from its parameters in order."""


def drawn(model: str, sample: Any) -> Impedance:
    """Impedance of one sample, of exact parameters."""
    return lambda s: IMPEDANCES[model](s, *(arb(float(value)) for value in sample))


def inverted(transform: Impedance, t: float) -> float:
    """Inverse Laplace transform at a time, by Talbot's contour [1]; it has 0.6 digits a node."""
    with ctx.workdps(45):
        radius = arb(2 * _NODES) / 5 / t
        total = (radius * t).exp() * transform(acb(radius)).real / 2
        for node in range(1, _NODES):
            angle = arb.pi() * node / _NODES
            cotangent = angle.cot()
            s = radius * angle * acb(cotangent, 1)
            turn = angle + (angle * cotangent - 1) * cotangent
            total += ((s * t).exp() * transform(s) * acb(1, turn)).real
        return float((total * radius / _NODES).mid())


def rotations(
    gripper: Gripper, sample: Impedance, torque: Course, time_s: Array, *, inertia: bool
) -> Array:
    """Closing rotations of both arms under steps, (2, n_times), from forces on each arm."""
    with ctx.workdps(45):
        b = arb(gripper.arm_length_m) * (arb(gripper.reference_angle_deg) / 180).sin_pi()

    def free(arm: Arm, s: Any) -> Any:
        moment = arm.inertia_kgm2 * s * s if inertia else 0
        return moment + arm.damping_Nms_per_rad * s + arm.stiffness_Nm_per_rad

    def transform(torque: float, which: int) -> Impedance:
        def both(s: Any) -> Any:
            # (Z_2 + b^2 G) phi_2 + b^2 G phi_4 = tau/s, and the same for the other arm.
            coupled = b * b * sample(s)
            left, right = free(gripper.left, s) + coupled, free(gripper.right, s) + coupled
            determinant = left * right - coupled * coupled
            return ((right, left)[which] - coupled) * (torque / s) / determinant

        return both

    found = np.zeros((2, len(time_s)))
    for start, height in zip(torque.time_s, torque.changes[:, 0].tolist(), strict=True):
        for i, t in enumerate(time_s):
            if t > start:
                for which in (0, 1):
                    found[which, i] += inverted(transform(height, which), t - start)
    return found
