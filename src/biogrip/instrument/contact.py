"""Closing of the arms from their neutral configuration onto a sample (section 2)."""

import math
from dataclasses import dataclass

import numpy as np

from biogrip.errors import BiogripError
from biogrip.instrument import actuator
from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.gripper import Gripper
from biogrip.instrument.linkage import rotation_of_tip

SMALLEST_M, LARGEST_M = 30e-6, 120e-6


@dataclass(frozen=True)
class Contact:
    """The configuration in which the jaws just touch a sample."""

    size_m: float
    """Diameter of the sample."""
    closing_rad: float
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
