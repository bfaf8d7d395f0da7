"""How large is what the model of the gripper leaves out; estimates, not corrections."""

import math

from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.gripper import Gripper

WATER_PA_S, WATER_KG_PER_M3 = 1.0e-3, 1.0e3


def drag_of_sample(size_m: float, viscosity_Pa_s: float = WATER_PA_S) -> float:
    """Stokes' drag 6 pi mu R of a sphere in N s/m, which its shortening does not exceed."""
    return 3 * math.pi * viscosity_Pa_s * size_m


def drag_of_arm(gripper: Gripper, width_m: float, viscosity_Pa_s: float = WATER_PA_S) -> float:
    """Drag in N m s/rad of an arm that turns in a liquid, all of it immersed.

    That of a slender rod sideways, 4 pi mu/(ln(l/d) + 0.84) a length (Tirado and
    Garcia de la Torre, J. Chem. Phys. 71, 2581, 1979), times the square of the distance
    from the pivot, along the arm.
    """
    length = gripper.arm_length_m
    a_length = 4 * math.pi * viscosity_Pa_s / (math.log(length / width_m) + 0.84)
    return a_length * length**3 / 3


def rolling_of_contact(gripper: Gripper, size_m: float, rotation_rad: float) -> float:
    """Share of the arm's length by which the point of contact moves along the jaw.

    A round sample that the jaw turns against rolls on it by its radius times the
    rotation. (That the tip itself moves on a circle the nonlinear model has.)
    """
    return 0.5 * size_m * rotation_rad / gripper.arm_length_m


def fringing_of_comb(comb: CombDrive) -> float:
    """Share of the capacitance that the fields at the fingers' edges add to eq. (7).

    Of two strips of width h at a distance g it is g/(pi h) [1 + ln(2 pi h/g)] (H. B.
    Palmer, Trans. AIEE 56, 363, 1937). Fingers beside fingers shield each other, so it
    is less in a comb.
    """
    share = comb.finger_gap_m / (math.pi * comb.thickness_m)
    return share * (1 + math.log(2 / share))


def mass_of_sample(size_m: float, density_kg_per_m3: float = WATER_KG_PER_M3) -> float:
    """Mass of a sphere in kg."""
    return density_kg_per_m3 * math.pi * size_m**3 / 6
