"""The sample between the jaws: closing onto it (section 2), its modulus, and neglected effects.

Biologists compare moduli, in Pa; springs and dampers, in N/m and N s/m, belong to one sample and
its size. Hertz's contact model relates them: a sphere of an incompressible elastic material between
two flat rigid jaws that do not stick, each of which indents it by half the shortening,

    F = 4/3 E/(1 - nu^2) R^(1/2) (delta/2)^(3/2)

(K. L. Johnson, Contact Mechanics, 1985, section 4.2). A cell in suspension and a drop are round,
and the jaws are flat and far stiffer; a cylinder's E = F L/(A delta) would need an area that is
rarely measured. The force grows faster than the shortening, so a spring has another modulus at
every shortening: the modulus is called apparent, and is given with its shortening. Hertz's theory
is one of small strains.
"""

import math
from dataclasses import dataclass

import numpy as np

from biogrip.errors import BiogripError
from biogrip.physics import gripper as actuator
from biogrip.physics.gripper import CombDrive, Gripper, rotation_of_tip

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


def contact(neutral: Gripper, jaw_gap_m: float, comb: CombDrive, size_m: float) -> Contact:
    """Compute the configuration of arms closed symmetrically onto a sample.

    Parameters
    ----------
    neutral
        The gripper with its neutral angle as the reference angle.
    jaw_gap_m
        Distance between the jaws there.
    comb
        The comb drive of each arm.
    size_m
        Diameter of the sample.

    Raises
    ------
    BiogripError
        If the sample is out of range, does not fit, or the comb's stroke does
        not reach it.
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
    torque = stiffness * closing
    return Contact(
        size_m,
        closing,
        neutral.reference_angle_deg - math.degrees(closing),
        torque,
        float(actuator.voltage(comb, torque)),
    )


WATER_PA_S, WATER_KG_PER_M3 = 1.0e-3, 1.0e3


def drag_of_sample(size_m: float, viscosity_Pa_s: float = WATER_PA_S) -> float:
    """Return Stokes' drag 6 pi mu R of a sphere in N s/m, an upper bound for its shortening."""
    return 3 * math.pi * viscosity_Pa_s * size_m


def drag_of_arm(gripper: Gripper, width_m: float, viscosity_Pa_s: float = WATER_PA_S) -> float:
    """Return the drag in N m s/rad of a fully immersed arm that turns in a liquid.

    The drag of a slender rod per length, moved sideways, is 4 pi mu/(ln(l/d) + 0.84)
    (Tirado and Garcia de la Torre, J. Chem. Phys. 71, 2581, 1979). Its product with the
    squared distance from the pivot is integrated along the arm.
    """
    length = gripper.arm_length_m
    a_length = 4 * math.pi * viscosity_Pa_s / (math.log(length / width_m) + 0.84)
    return a_length * length**3 / 3


def rolling_of_contact(gripper: Gripper, size_m: float, rotation: float) -> float:
    """Return the shift of the contact point along the jaw, as a share of the arm's length.

    A round sample rolls on the turning jaw by its radius times the rotation. (The circle
    on which the tip moves is part of the nonlinear model.)
    """
    return 0.5 * size_m * rotation / gripper.arm_length_m


def fringing_of_comb(comb: CombDrive) -> float:
    """Return the increase of capacitance by fringing fields, relative to eq. (7).

    For two strips of width h at a distance g it is g/(pi h) [1 + ln(2 pi h/g)] (H. B.
    Palmer, Trans. AIEE 56, 363, 1937). It is less in a comb, where neighbouring fingers
    shield each other.
    """
    share = comb.finger_gap_m / (math.pi * comb.thickness_m)
    return share * (1 + math.log(2 / share))


def mass_of_sample(size_m: float, density_kg_per_m3: float = WATER_KG_PER_M3) -> float:
    """Return the mass of a sphere in kg."""
    return density_kg_per_m3 * math.pi * size_m**3 / 6


INCOMPRESSIBLE = 0.5


def apparent_modulus(
    force_N: float, shortening_m: float, size_m: float, poisson: float = INCOMPRESSIBLE
) -> float:
    """Return Young's modulus in Pa of a sphere from a force and the shortening it causes.

    The shortening is counted from first contact, the size is the sphere's diameter, and `poisson`
    is Poisson's ratio of the material.
    """
    indentation, radius = 0.5 * shortening_m, 0.5 * size_m
    return 0.75 * (1 - poisson**2) * force_N / math.sqrt(radius * indentation**3)
