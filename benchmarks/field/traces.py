"""Noisy traces of samples that are held by arms so soft that the force is the given one.

Arms turn by phi under the torque tau, each tip moves b phi, and the sample is shortened by
2 b phi. Of the torque the hinge takes k phi and the sample the rest, so the force on it is
(tau - k phi)/b, and

    phi (2 b^2/tau) = J / (1 + k J/(2 b^2)) ~ J

with J the sample's creep compliance. Here k J/(2 b^2) is some 10^-7, and so is what the
arms' damping adds, which is just large enough that arms as light as these do not ring:
five decades below the noise (`tests/test_field_benchmark.py`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.field.elements import Maxwell
from biogrip.arrays import Array
from biogrip.experiment.random_streams import stream
from biogrip.library import (
    Arm,
    CaseProblem,
    Gripper,
    Noise,
    Sample,
    add_noise,
    hold,
    set_up,
    simulate,
)

SAMPLES = {
    1: Maxwell(1.0, np.array([2.0]), np.array([20.0])),
    2: Maxwell(1.0, np.array([2.0, 2.0]), np.array([3.0, 40.0])),
    3: Maxwell(1.0, np.array([4.0, 2.0, 1.0]), np.array([1.5, 10.0, 60.0])),
}
"""By number of branches; of the order of 1 N/m, that nobody's absolute tolerance bites."""

DURATION_S, INTERVALS, TORQUE_NM = 500.0, 1000, 1e-9
NOISE = Noise("gaussian", 0.01, "peak")

_ARM = Arm(inertia_kgm2=1e-20, damping_Nms_per_rad=1e-12, stiffness_Nm_per_rad=1e-12)
GRIPPER = Gripper(arm_length_m=1.5e-3, reference_angle_deg=75.0, left=_ARM, right=_ARM)
PROTOCOL = (hold(DURATION_S, TORQUE_NM),)


@dataclass(frozen=True)
class Trace:
    """One noisy trace, and what can be read off it.

    Parameters
    ----------
    branches
        Of the sample.
    seed
        Of the noise.
    """

    branches: int
    seed: int

    @property
    def sample(self) -> Maxwell:
        """What made the trace."""
        return SAMPLES[self.branches]

    @cached_property
    def experiment(self) -> CaseProblem:
        """What biogrip is told; the parallel damper is known to be none."""
        return experiment_of(self.branches)

    @cached_property
    def recorded_s(self) -> Array:
        """Times of the recording; it starts with the torque, when nothing has moved yet."""
        return np.linspace(0.0, DURATION_S, INTERVALS + 1)

    @cached_property
    def clean_rad(self) -> Array:
        """Rotation without noise."""
        sample, names = self.sample, self.experiment.searched.names
        elements = (*sample.k, sample.k_p, *(sample.k * sample.tau))
        given = dict(zip(names, map(float, elements), strict=True))
        return simulate(self.experiment, {**given, "c_p": 0.0}, self.recorded_s)

    @cached_property
    def rotation_rad(self) -> Array:
        """Rotation as recorded."""
        return add_noise(self.clean_rad, NOISE, self._stream("noise"))

    @property
    def time_s(self) -> Array:
        """Times for those who see a compliance: where it jumps there is none to be seen."""
        return self.recorded_s[1:]

    @cached_property
    def compliance(self) -> Array:
        """Creep compliance as recorded, in m/N."""
        return as_compliance(self.rotation_rad)[1:]

    @property
    def compliance_noise(self) -> float:
        """Standard deviation of its noise."""
        return NOISE.level * float(as_compliance(self.clean_rad).max())

    @cached_property
    def modulus(self) -> Array:
        """Relaxation modulus with noise of the same share of its peak, in N/m."""
        clean = self.sample.modulus(self.time_s)
        noise = self._stream("relaxation").standard_normal(len(clean))
        return np.asarray(clean + self.modulus_noise * noise)

    @property
    def modulus_noise(self) -> float:
        """Standard deviation of its noise."""
        return NOISE.level * float(self.sample.modulus(self.time_s).max())

    def _stream(self, purpose: str) -> np.random.Generator:
        return stream(0, f"field, {self.branches} branches", self.seed, purpose)


_EXPERIMENTS = {
    branches: set_up(
        GRIPPER,
        PROTOCOL,
        Sample("generalized_maxwell", branches),
        fixed={"c_p": 0.0},
    )
    for branches in SAMPLES
}


def experiment_of(branches: int) -> CaseProblem:
    """Return the experiment with a sample of so many branches, one for all its traces."""
    return _EXPERIMENTS[branches]


def as_compliance(rotation_rad: Array) -> Array:
    """Return the shortening over the force if arms take none of it, in m/N."""
    compliance: Array = rotation_rad * (2 * GRIPPER.lever_m**2 / TORQUE_NM)
    return compliance
