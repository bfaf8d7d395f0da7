"""The gripper: two arms, a lever that squeezes the sample (Table 1), the comb drive, and contact.

The rotary comb drive turns a voltage into a torque (eqs. 7-9), which closes the arms onto the
sample (section 2).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.keys import Block, Complaint

_LARGEST_QUALITY = 1e6

ARM_KEYS = ("inertia_kgm2", "damping_Nms_per_rad", "stiffness_Nm_per_rad")
"""Keys of an arm."""


@dataclass(frozen=True)
class Arm(Block):
    """One arm on its flexure hinge, reduced to a rigid body on a pivot: eqs. (1) and (2)."""

    inertia_kgm2: Annotated[float, Field(ge=1e-20, le=1.0)]
    """Moment of inertia I of the arm about its pivot."""
    damping_Nms_per_rad: Annotated[float, Field(ge=1e-20, le=1.0)]
    """Rotational damping c of the arm; at least what makes its quality factor a million."""
    stiffness_Nm_per_rad: Annotated[float, Field(ge=1e-12, le=1e3)]
    """Rotational stiffness k of the arm's flexure hinge."""

    @property
    def natural_frequency_Hz(self) -> float:
        """Undamped frequency of the free arm."""
        return math.sqrt(self.stiffness_Nm_per_rad / self.inertia_kgm2) / (2 * math.pi)

    @property
    def quality_factor(self) -> float:
        """Quality factor of the free arm."""
        return math.sqrt(self.inertia_kgm2 * self.stiffness_Nm_per_rad) / self.damping_Nms_per_rad

    def complaints(self) -> Iterator[Complaint]:
        """Find a quality factor so large that the decay would be lost in rounding."""
        if self.quality_factor > _LARGEST_QUALITY:
            text = f"makes the arm's quality factor {self.quality_factor:.3g}, "
            yield ("damping_Nms_per_rad",), f"{text}allowed is at most {_LARGEST_QUALITY:g}."


@dataclass(frozen=True)
class Gripper(Block):
    """The chain A-B-C-D: left arm AB (index 2), right arm DC (index 4), sample BC.

    The reference angle is hat-theta_2; the right arm stands at 180 degrees minus it.
    """

    # Pydantic takes no docstrings from the class that a class inherits from.
    arm_length_m: Annotated[
        float,
        Field(ge=1e-6, le=1.0, description="Length l of both arms, from pivot to tip."),
    ]
    reference_angle_deg: Annotated[
        float,
        Field(
            ge=10,
            le=90,
            description="Angle of the left arm when the jaws just touch the sample; for a case "
            "that gives its sample's size, the angle in the neutral configuration, from which the "
            "other follows. Only its sine enters the linear model.",
        ),
    ]
    left: Arm
    right: Arm

    @property
    def lever_m(self) -> float:
        """Tip displacement per closing rotation at the reference, l sin(hat-theta_2)."""
        return self.arm_length_m * math.sin(math.radians(self.reference_angle_deg))

    @property
    def has_inertia(self) -> bool:
        """True if any of its arms has an inertia, so that it may ring."""
        return bool(self.left.inertia_kgm2 or self.right.inertia_kgm2)

    @property
    def jaw_stiffness_N_per_m(self) -> float:
        """Stiffness of both hinges as seen from the sample: force over closing of the jaws."""
        yielding = 1 / self.left.stiffness_Nm_per_rad + 1 / self.right.stiffness_Nm_per_rad
        return 1 / (self.lever_m**2 * yielding)


# Far below what any sample has, in any units; the squares of its reciprocals are no overflow.
_TINY = 1e-40

_NO_ARM = Arm(0.0, _TINY, _TINY)
NO_ARMS = Gripper(math.sqrt(0.5), 90.0, _NO_ARM, _NO_ARM)
"""Arms that do nothing: with a squared lever of 1/2 they turn by what a sample creeps."""


def rotation_of_tip(gripper: Gripper, displacement_m: Array) -> Array:
    """Return the rotation phi in rad that moves a tip by u = l [cos(hat - phi) - cos hat].

    The solution has no cancellation of nearly equal cosines. It is NaN beyond the
    displacement at which the arms lie flat.
    """
    angle = np.radians(gripper.reference_angle_deg)
    cos, sin = np.cos(angle), np.sin(angle)
    x = displacement_m / gripper.arm_length_m
    rest = x * (2 * cos + x)
    with np.errstate(invalid="ignore"):
        new_sin = np.sqrt(sin * sin - rest)
    return np.arctan2(sin * x + cos * rest / (sin + new_sin), cos * (cos + x) + sin * new_sin)


VACUUM_PERMITTIVITY_F_PER_M = 8.8541878128e-12


@dataclass(frozen=True)
class CombDrive(Block):
    """Geometry of one rotary comb drive (Table 2)."""

    thickness_m: Annotated[float, Field(ge=1e-9, le=1e-2)]
    """Thickness h of the device layer."""
    finger_width_m: Annotated[float, Field(ge=1e-9, le=1e-2)]
    """Width d of a finger."""
    finger_gap_m: Annotated[float, Field(ge=1e-9, le=1e-2)]
    """Gap g between neighbouring fingers."""
    fingers: Annotated[int, Field(ge=1, le=10_000)]
    """Number n of floating fingers."""
    first_radius_m: Annotated[float, Field(ge=1e-9, le=1.0)]
    """Radius r₀ of the first finger."""
    finger_angle_deg: Annotated[float, Field(ge=1e-6, le=360)]
    """Angle that a finger subtends."""
    stroke_deg: Annotated[float, Field(ge=1e-6, le=360)]
    """Largest rotation of the drive."""
    initial_overlap_deg: Annotated[float, Field(ge=0, le=360)]
    """Overlap of the fingers at rest."""

    @property
    def pitch_m(self) -> float:
        """Radial distance 2 (d + g) between two floating fingers."""
        return 2 * (self.finger_width_m + self.finger_gap_m)

    @property
    def outer_radius_m(self) -> float:
        """Radius that the last finger reaches, r_0 + n 2 (d + g)."""
        return self.first_radius_m + self.fingers * self.pitch_m


def capacitance_slope(comb: CombDrive) -> float:
    """Return the change of capacitance with overlap angle, dC_T/dtheta, in F/rad (eq. 7).

    Every gap between a fixed and a floating finger is a cylindrical capacitor,
    eps_0 h theta / ln(r_outer / r_inner); the drive is their sum.
    """
    d, g, r_0 = comb.finger_width_m, comb.finger_gap_m, comb.first_radius_m
    inner = r_0 + np.arange(1, comb.fingers) * comb.pitch_m
    outer = r_0 + np.arange(comb.fingers) * comb.pitch_m
    ln_a = np.log(inner / (inner - g))
    ln_b = np.log((outer + d + g) / (outer + d))
    total = np.sum(1 / ln_a) + np.sum(1 / ln_b)
    return float(VACUUM_PERMITTIVITY_F_PER_M * comb.thickness_m * total)


def torque(comb: CombDrive, voltage_V: ArrayLike) -> Array:
    """Return the electrostatic torque in N m at a voltage in V (eqs. 8, 9)."""
    return 0.5 * capacitance_slope(comb) * np.square(np.asarray(voltage_V, dtype=float))


def voltage(comb: CombDrive, torque_Nm: ArrayLike) -> Array:
    """Return the voltage in V of a torque in N m (eq. 9); a negative one is a `ValueError`."""
    torques = np.asarray(torque_Nm, dtype=float)
    if np.any(torques < 0):
        raise ValueError(f"a comb drive only pulls: torque {torques.min()} N m is negative")
    return np.sqrt(2 * torques / capacitance_slope(comb))


SMALLEST_M, LARGEST_M = 30e-6, 120e-6


@dataclass(frozen=True)
class Contact:
    """The configuration in which the jaws just touch a sample."""

    size_m: float
    """Diameter of the sample."""
    closing: float
    """Rotation of each arm from its neutral position."""
    reference_angle_deg: float
    """hat-theta_2 in this configuration."""
    torque_Nm: float
    """Torque that holds the stiffer arm there against its hinge."""
    voltage_V: float
    """Voltage that gives this torque."""


def find_contact(neutral: Gripper, jaw_gap_m: float, comb: CombDrive, size_m: float) -> Contact:
    """Compute the configuration of arms closed symmetrically onto a sample of a diameter.

    Given are the gripper with its neutral angle as the reference angle, the distance between the
    jaws there, and the comb drive of each arm. A sample that is out of range, does not fit, or that
    the comb's stroke does not reach, is a `BiogripError`.
    """
    if not SMALLEST_M * (1 - 1e-9) <= size_m <= LARGEST_M * (1 + 1e-9):
        allowed = f"{1e6 * SMALLEST_M:g} to {1e6 * LARGEST_M:g} um"
        raise BiogripError(f"found a sample of {1e6 * size_m:g} um, allowed are {allowed}.")
    if size_m > jaw_gap_m:
        raise BiogripError(
            f"found a sample of {1e6 * size_m:g} um, allowed is at most the jaw gap, "
            f"{1e6 * jaw_gap_m:g} um."
        )
    closing = float(rotation_of_tip(neutral, np.array(0.5 * (jaw_gap_m - size_m))))
    stroke = math.radians(comb.stroke_deg)
    if not math.isfinite(closing):
        raise BiogripError(
            f"a sample of {1e6 * size_m:g} um is out of the arms' reach; allowed is a larger "
            "sample, a smaller jaw gap or longer arms."
        )
    if not closing <= stroke:
        raise BiogripError(
            f"a sample of {1e6 * size_m:g} um takes {math.degrees(closing):.3g} degrees of each "
            f"arm, allowed is the comb's stroke, {comb.stroke_deg:g} degrees."
        )
    stiffness = max(neutral.left.stiffness_Nm_per_rad, neutral.right.stiffness_Nm_per_rad)
    held_Nm = stiffness * closing
    return Contact(
        size_m,
        closing,
        neutral.reference_angle_deg - math.degrees(closing),
        held_Nm,
        float(voltage(comb, held_Nm)),
    )
