"""The rotary comb drive: capacitance, torque and voltage (eqs. 7-9)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array

VACUUM_PERMITTIVITY_F_PER_M = 8.8541878128e-12


@dataclass(frozen=True)
class CombDrive:
    """Geometry of one rotary comb drive (Table 2).

    Parameters
    ----------
    thickness_m
        Thickness h of the device layer.
    finger_width_m
        Width d of a finger.
    finger_gap_m
        Gap g between neighbouring fingers.
    fingers
        Number n of floating fingers.
    first_radius_m
        Radius r_0 of the first finger.
    finger_angle_deg, stroke_deg, initial_overlap_deg
        Angle subtended by a finger, largest rotation, overlap at rest.
    """

    thickness_m: float
    finger_width_m: float
    finger_gap_m: float
    fingers: int
    first_radius_m: float
    finger_angle_deg: float
    stroke_deg: float
    initial_overlap_deg: float

    @property
    def pitch_m(self) -> float:
        """Radial distance 2 (d + g) between two floating fingers."""
        return 2 * (self.finger_width_m + self.finger_gap_m)

    @property
    def outer_radius_m(self) -> float:
        """Radius that the last finger reaches, r_0 + n 2 (d + g)."""
        return self.first_radius_m + self.fingers * self.pitch_m


def capacitance_slope(comb: CombDrive) -> float:
    """Change of capacitance with overlap angle, dC_T/dtheta, in F/rad (eq. 7).

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


def capacitance(comb: CombDrive, overlap_rad: ArrayLike) -> Array:
    """Capacitance C_T in F at an overlap angle in rad (eq. 7)."""
    return capacitance_slope(comb) * np.asarray(overlap_rad, dtype=float)


def torque(comb: CombDrive, voltage_V: ArrayLike) -> Array:
    """Electrostatic torque in N m at a voltage in V (eqs. 8, 9)."""
    return 0.5 * capacitance_slope(comb) * np.square(np.asarray(voltage_V, dtype=float))


def voltage(comb: CombDrive, torque_Nm: ArrayLike) -> Array:
    """Voltage in V that exerts a torque in N m (eq. 9 solved for V).

    Raises
    ------
    ValueError
        If a torque is negative: a comb drive only pulls.
    """
    wanted = np.asarray(torque_Nm, dtype=float)
    if np.any(wanted < 0):
        raise ValueError(f"a comb drive only pulls: torque {wanted.min()} N m is negative")
    return np.sqrt(2 * wanted / capacitance_slope(comb))
