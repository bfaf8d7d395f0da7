"""The rotary comb drive: torque and voltage (eqs. 7-9)."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array
from biogrip.keys import Key

VACUUM_PERMITTIVITY_F_PER_M = 8.8541878128e-12


@dataclass(frozen=True)
class CombDrive:
    """Geometry of one rotary comb drive (Table 2)."""

    thickness_m: Annotated[float, Key("Thickness h of the device layer.", "m", low=1e-9, high=1e-2)]
    finger_width_m: Annotated[float, Key("Width d of a finger.", "m", low=1e-9, high=1e-2)]
    finger_gap_m: Annotated[
        float, Key("Gap g between neighbouring fingers.", "m", low=1e-9, high=1e-2)
    ]
    fingers: Annotated[int, Key("Number n of floating fingers.", low=1, high=10_000)]
    first_radius_m: Annotated[float, Key("Radius r₀ of the first finger.", "m", low=1e-9, high=1.0)]
    finger_angle_deg: Annotated[
        float, Key("Angle that a finger subtends.", "deg", low=1e-6, high=360)
    ]
    stroke_deg: Annotated[float, Key("Largest rotation of the drive.", "deg", low=1e-6, high=360)]
    initial_overlap_deg: Annotated[
        float, Key("Overlap of the fingers at rest.", "deg", low=0, high=360)
    ]

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
