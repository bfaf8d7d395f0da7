"""Power-law samples without the library: Mittag-Leffler functions, and inversion by mpmath."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from mpmath import mp, mpf
from scipy.integrate import quad

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.instrument.gripper import Arm, Gripper

Impedance = Callable[[Any], Any]


def mittag_leffler(a: float, b: float, x: float) -> float:
    """E_(a,b)(-x) by its series, sum (-x)^k / Gamma(a k + b); terms are as large as e^(x^(1/a))."""
    with mp.workdps(40 + int(0.9 * x ** (1 / a))):
        a_, b_, x_ = mpf(a), mpf(b), mpf(x)
        total, k = mpf(0), 0
        while True:
            term = (-x_) ** k * mp.rgamma(a_ * k + b_)
            total += term
            if k > x ** (1 / a) / a and abs(term) < mpf(10) ** -30 * abs(total):
                return float(total)
            k += 1


def one_minus_mittag_leffler(a: float, x: float) -> float:
    """1 - E_a(-x), for any x, by its spectrum: int K(r) (1 - e^(-r t)) dr with t^a = x."""
    if x ** (1 / a) < 30:
        return x * mittag_leffler(a, 1 + a, x)
    log_t, cosine = math.log(x) / a, math.cos(math.pi * a)

    def share(u: float) -> float:
        # dr/r of the spectrum, symmetric in log r; from e^4 on the exponential is below rounding.
        faded = -math.expm1(-math.exp(min(u + log_t, 4.0)))
        return faded / (2 * math.cosh(a * u) + 2 * cosine)

    # Where (1 - e^(-r t)) turns, where the spectrum peaks, and far from both.
    turn, far = -log_t, 70 / a
    edges = sorted({-far - abs(turn), turn - 5, turn, turn + 5, -1.0, 0.0, 1.0, far})
    # The whole is between a half and one, times pi over the sine: twelve digits are left.
    parts = [
        quad(share, *ends, epsabs=1e-14, epsrel=1e-12, limit=400)[0] for ends in pairwise(edges)
    ]
    return math.sin(math.pi * a) / math.pi * math.fsum(parts)


def inverted(transform: Impedance, t: float) -> float:
    """Inverse Laplace transform at a time, by Talbot's contour."""
    with mp.workdps(30):
        return float(mp.invertlaplace(transform, mpf(float(t)), method="talbot", degree=45))


def springpot(modulus: float, exponent: float) -> Impedance:
    return lambda s: mpf(modulus) * s ** mpf(exponent)


def rotations(
    gripper: Gripper, sample: Impedance, torque: TorqueHistory, time_s: Array, *, inertia: bool
) -> Array:
    """Closing rotations of both arms under steps, (2, n_times), from forces on each arm."""
    with mp.workdps(30):
        b = mpf(gripper.arm_length_m) * mp.sin(mp.radians(mpf(gripper.reference_angle_deg)))

    def free(arm: Arm, s: Any) -> Any:
        moment = mpf(arm.inertia_kgm2) * s * s if inertia else 0
        return moment + mpf(arm.damping_Nms_per_rad) * s + mpf(arm.stiffness_Nm_per_rad)

    def transform(torques: tuple[float, float], which: int) -> Impedance:
        def both(s: Any) -> Any:
            # (Z_2 + b^2 G) phi_2 + b^2 G phi_4 = tau_2/s, and the same for the other arm.
            coupled = b * b * sample(s)
            left, right = free(gripper.left, s) + coupled, free(gripper.right, s) + coupled
            determinant = left * right - coupled * coupled
            loads = [mpf(value) / s for value in torques]
            first = right * loads[0] - coupled * loads[1]
            second = left * loads[1] - coupled * loads[0]
            return (first, second)[which] / determinant

        return both

    found = np.zeros((2, len(time_s)))
    steps = zip(torque.time_s, torque.left[:, 0], torque.right[:, 0], strict=True)
    for start, *torques in steps:
        given = (float(torques[0]), float(torques[1]))
        for i, t in enumerate(time_s):
            if t > start:
                for which in (0, 1):
                    found[which, i] += inverted(transform(given, which), t - start)
    return found
