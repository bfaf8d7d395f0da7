"""Equal arms and their sample by SciPy's Radau, from the corrected eqs. (1)-(3)."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper

# Of a step. What comes out is then 1e-9 of the peak away from where 1e-10 leads, in the worst of
# all cases here, which is a hundredth of what is asked.
TOLERANCE = 1e-8
Torques = Sequence[tuple[float, float | Callable[[float], float]]]


def tip(gripper: Gripper, phi: float) -> tuple[float, float]:
    """Displacement and lever of a tip, eq. by eq. as in docs/model.md."""
    hat, length = math.radians(gripper.reference_angle_deg), gripper.arm_length_m
    return 2 * length * math.sin(hat - phi / 2) * math.sin(phi / 2), length * math.sin(hat - phi)


def equal_arms(
    gripper: Gripper,
    sample: Array,
    torques: Torques,
    time_s: Array,
    peak: float,
    *,
    inertia: bool = False,
) -> Array:
    """Rotation and jaw force, (2, n_times), of equal arms under torques until some times.

    The sample is (k, k_p, c, c_p); errors are relative to a peak rotation.
    """
    k, k_p, c, c_p = (float(value) for value in sample)
    arm = gripper.left

    def slope(t: float, state: Any, torque: Any) -> list[float]:
        phi, y = state[0], state[-1]
        u, b = tip(gripper, phi)
        tau = torque(t) if callable(torque) else torque
        rest = tau - arm.stiffness_Nm_per_rad * phi - b * (k_p * 2 * u + k * (2 * u - y))
        damping, y_rate = arm.damping_Nms_per_rad + 2 * c_p * b * b, k / c * (2 * u - y)
        if inertia:
            return [state[1], (rest - damping * state[1]) / arm.inertia_kgm2, y_rate]
        return [rest / damping, y_rate]

    lowest = 1e-11 * peak
    allowed = [lowest, *([lowest] if inertia else []), lowest * gripper.arm_length_m]
    state, found, start = np.zeros(len(allowed)), [], 0.0
    for end, torque in torques:
        here = time_s[(time_s > start) & (time_s <= end)]
        solved = solve_ivp(
            slope,
            (start, end),
            state,
            "Radau",
            np.unique(np.append(here, end)),
            args=(torque,),
            rtol=TOLERANCE,
            atol=allowed,
            max_step=0.2 if callable(torque) else np.inf,
        )
        assert solved.success, solved.message
        for t, now in zip(here, solved.y.T, strict=False):
            rate = now[1] if inertia else slope(t, now, torque)[0]
            u, b = tip(gripper, now[0])
            force = k_p * 2 * u + c_p * 2 * b * rate + k * (2 * u - now[-1])
            found.append((now[0], force))
        state, start = solved.y[:, -1], end
    return np.transpose(found)
