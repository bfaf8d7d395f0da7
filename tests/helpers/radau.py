"""Both arms and their sample by SciPy's Radau, from the corrected eqs. (1)-(3)."""

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course, evaluate

# Of a step. What comes out is then 1e-9 of the peak away from where 1e-10 leads, in the worst of
# all cases here, which is a hundredth of what is asked.
TOLERANCE = 1e-8


def integrated(
    gripper: Gripper,
    sample: Array,
    torque: Course,
    time_s: Array,
    peak: float,
    *,
    inertia: bool = False,
    max_step_s: float = np.inf,
) -> Array:
    """Rotations and, last, jaw force, (n_arms + 1, n_times); of equal arms one stands for both.

    The sample is (k, k_p, c, c_p); errors are relative to a peak rotation.
    """
    k, k_p, c, c_p = (float(value) for value in sample)
    arms = [gripper.left] if gripper.left == gripper.right else [gripper.left, gripper.right]
    inertias, dampings, stiffnesses = np.transpose([[*vars(arm).values()] for arm in arms])
    hat, length = math.radians(gripper.reference_angle_deg), gripper.arm_length_m
    n, share = len(arms), 2 / len(arms)

    def motion(t: float, state: Array) -> tuple[Array, float]:
        phi, y = state[:n], state[-1]
        b = length * np.sin(hat - phi)
        delta = share * np.sum(2 * length * np.sin(hat - phi / 2) * np.sin(phi / 2))
        spring = k_p * delta + k * (delta - y)
        rest = float(evaluate(torque, t)) - stiffnesses * phi - b * spring
        rates = state[n:-1]
        if not inertia:
            # Of c_i phi_i' + c_p b_i delta' = rest_i, without a difference of terms with c_p.
            m = share * c_p * b / dampings
            rates = rest + (np.outer(rest, b) - np.outer(b, rest)) @ m
            rates = rates / (dampings * (1 + b @ m))
        viscous = c_p * share * (b @ rates)
        faster = (rest - dampings * rates - b * viscous) / inertias if inertia else []
        return np.concatenate((rates, faster, [k / c * (delta - y)])), spring + viscous

    allowed = 1e-11 * peak * np.append(np.ones(n * (1 + inertia)), length)
    state, found = np.zeros(len(allowed)), []
    for start, end in pairwise([*torque.time_s, torque.end_s]):
        last = np.nextafter(end, start)
        here = np.minimum(time_s[(time_s > start) & (time_s <= end)], last)
        at = np.unique(np.append(here, last))
        given = {"rtol": TOLERANCE, "atol": allowed, "max_step": max_step_s}
        solved = solve_ivp(lambda t, z: motion(t, z)[0], (start, last), state, "Radau", at, **given)
        assert solved.success, solved.message
        for t, now in zip(here, solved.y.T, strict=False):
            found.append(np.append(now[:n], motion(t, now)[1]))
        state = solved.y[:, -1]
    return np.transpose(found)
