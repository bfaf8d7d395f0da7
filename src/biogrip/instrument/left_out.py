"""Estimates of effects that the model of the gripper neglects."""

import math

from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.gripper import Gripper

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


def rolling_of_contact(gripper: Gripper, size_m: float, rotation_rad: float) -> float:
    """Return the shift of the contact point along the jaw, as a share of the arm's length.

    A round sample rolls on the turning jaw by its radius times the rotation. (The circle
    on which the tip moves is part of the nonlinear model.)
    """
    return 0.5 * size_m * rotation_rad / gripper.arm_length_m


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
