"""The rotary comb drive: torque and voltage (eqs. 7-9)."""

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block

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
    """Return the voltage in V that exerts a torque in N m (eq. 9 solved for V).

    Raises
    ------
    ValueError
        If a torque is negative: a comb drive only pulls.
    """
    torques = np.asarray(torque_Nm, dtype=float)
    if np.any(torques < 0):
        raise ValueError(f"a comb drive only pulls: torque {torques.min()} N m is negative")
    return np.sqrt(2 * torques / capacitance_slope(comb))


def torque_uncertainty(
    comb: CombDrive, voltage_share: float, finger_gap_m: float, thickness_m: float
) -> float:
    """Return the relative standard uncertainty of the torque, by eqs. (7)-(9).

    The mask fixes the pitch of the fingers, so that a finger is narrower by what its gap is wider.

    Parameters
    ----------
    comb
        The comb drive.
    voltage_share
        Relative standard uncertainty of the voltage.
    finger_gap_m, thickness_m
        Standard uncertainties of the gap and of the height of the fingers.
    """
    wide, narrow = (
        capacitance_slope(
            replace(
                comb,
                finger_gap_m=comb.finger_gap_m + error,
                finger_width_m=comb.finger_width_m - error,
            )
        )
        for error in (0.5 * finger_gap_m, -0.5 * finger_gap_m)
    )
    by_gap = (wide - narrow) / capacitance_slope(comb)
    return math.hypot(2 * voltage_share, by_gap, thickness_m / comb.thickness_m)
