"""Protocols and samples to try, and an independent solution with 50 digits.

Of the corrected linear model's solution nothing is shared with the library: forces of
springs and dampers are written down arm by arm, as in the corrected eqs. (4)-(6), and the
five first-order equations solved through the eigenvectors of their matrix.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpmath import mp, mpf

from biogrip.arrays import Array
from biogrip.experiment.protocol import Harmonic, Load, Phase, TorqueHistory, held
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper

SWING = Load(1e-9, 0.0, 0.0, (Harmonic(4e-10, 0.3, -np.pi / 2),))
PROTOCOLS = {
    "steps": (held(200.0, 1.6e-9), held(200.0, 0.32e-9)),
    "ramp, parabola and sinusoid": (
        Phase(50.0, Load(0.0, 2e-11), Load(0.0, 2e-11)),
        Phase(150.0, Load(1e-9, 1e-12, 1e-14), Load(1e-9, 1e-12, 1e-14)),
        Phase(200.0, SWING, SWING),
    ),
    "arms driven differently": (held(200.0, 1.6e-9, 1.0e-9), held(200.0, 0.3e-9, 0.5e-9)),
}
MODEL_PARAMETERS: dict[str, list[float]] = {
    "generalized_maxwell": [9.5, 0.3, 10.0, 0.7],
    "liquid_drop": [9.5, 0.3, 10.0],
    "damper": [10.0],
    "kelvin_voigt": [0.3, 10.0],
    "maxwell": [2.0, 50.0],
    "zener_maxwell": [2.0, 1.0, 50.0],
    "zener_kelvin": [3.0, 2.0, 40.0],
    "burgers": [3.0, 200.0, 2.0, 40.0],
    "fractional_kelvin_voigt": [0.3, 10.0, 0.4],
    "fractional_maxwell": [10.0, 0.3, 300.0],
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


def rotation_50_digits(
    gripper: Gripper, parameters: Array, steps: TorqueHistory, time_s: Array
) -> Array:
    """phi_2 of one sample (k, k_p, c, c_p) with inertia, shape (n_times,)."""
    found = _output_50_digits(gripper, parameters, steps, time_s, of_force=False)
    return np.array([float(value) for value in found])


def sensitivity_50_digits(
    gripper: Gripper, parameters: Array, steps: TorqueHistory, time_s: Array
) -> Array:
    """d phi_2 / d log p by central differences, which with 50 digits lose none of a double's."""
    rows = []
    with mp.workdps(50):
        step = mpf(10) ** -15
        for index in range(len(parameters)):
            both = []
            for sign in (1, -1):
                moved = [mpf(float(value)) for value in parameters]
                moved[index] *= mp.exp(sign * step)
                both.append(_output_50_digits(gripper, moved, steps, time_s, of_force=False))
            rows.append([float((a - b) / (2 * step)) for a, b in zip(*both, strict=True)])
    return np.array(rows)


def jaw_force_50_digits(
    gripper: Gripper, parameters: Array, steps: TorqueHistory, time_s: Array
) -> Array:
    """Force of the springs and dampers on the tips in N, shape (n_times,)."""
    found = _output_50_digits(gripper, parameters, steps, time_s, of_force=True)
    return np.array([float(value) for value in found])


def _output_50_digits(
    gripper: Gripper,
    parameters: Sequence[Any] | Array,
    steps: TorqueHistory,
    time_s: Array,
    *,
    of_force: bool,
) -> list[Any]:
    with mp.workdps(50):
        k, k_p, c, c_p = (mpf(value) for value in parameters)
        b = mpf(gripper.arm_length_m) * mp.sin(mp.radians(mpf(gripper.reference_angle_deg)))
        inertia, damping, stiffness = (
            [mpf(getattr(arm, name)) for arm in (gripper.left, gripper.right)]
            for name in ("inertia_kgm2", "damping_Nms_per_rad", "stiffness_Nm_per_rad")
        )
        # State: phi_2, phi_4, their rates, and the node x between spring k and damper c.
        # Force on each tip: k (b phi_2 - x) + k_p delta + c_p delta', delta = b (phi_2 + phi_4).
        force = [(k + k_p) * b, k_p * b, c_p * b, c_p * b, -k]
        a = mp.zeros(5)
        a[0, 2] = a[1, 3] = 1
        for row, arm in ((2, 0), (3, 1)):
            for column in range(5):
                a[row, column] = -b * force[column] / inertia[arm]
            a[row, arm] -= stiffness[arm] / inertia[arm]
            a[row, 2 + arm] -= damping[arm] / inertia[arm]
        # k (u_B - x) = c (x' - u_C'), u_B = b phi_2, u_C = -b phi_4.
        a[4, 0], a[4, 4], a[4, 3] = k / c * b, -k / c, -b
        rates, vectors = mp.eig(a)
        seen = mp.matrix([force if of_force else [1, 0, 0, 0, 0]])
        found = [mpf(0)] * len(time_s)
        for start, left, right in zip(
            steps.time_s, steps.left[:, 0], steps.right[:, 0], strict=True
        ):
            load = mp.matrix(5, 1)
            load[2], load[3] = mpf(float(left)) / inertia[0], mpf(float(right)) / inertia[1]
            rest = mp.lu_solve(a, -load)
            weights = mp.lu_solve(vectors, -rest)
            amplitudes = [(seen * vectors[:, j])[0] * weights[j] for j in range(5)]
            for i, t in enumerate(time_s):
                elapsed = mpf(float(t)) - mpf(float(start))
                if elapsed >= 0:
                    terms = (amplitudes[j] * mp.exp(rates[j] * elapsed) for j in range(5))
                    found[i] += (seen * rest)[0] + mp.re(mp.fsum(terms))
        return found


def log_range(model: SampleModel) -> tuple[Array, Array]:
    """Logarithms of the ends of a model's search range."""
    low, high = zip(*(LOG_RANGES[parameter.kind] for parameter in model.parameters), strict=True)
    return np.array(low), np.array(high)


def random_samples(count: int, seed: int) -> Array:
    """Chromosomes drawn uniformly from the whole search range (k, k_p, c, c_p)."""
    rng = np.random.default_rng(seed)
    exponent = rng.integers([-3, -3, -4, -4], [8, 8, 5, 5], size=(count, 4), endpoint=True)
    first, second = rng.integers(1, 9, size=(2, count, 4), endpoint=True)
    return 10.0**exponent * (0.1 * first + 0.01 * second)
