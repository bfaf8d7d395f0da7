"""The two gripper arms and the lever with which they squeeze the sample (Table 1)."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Arm:
    """One arm on its flexure hinge, reduced to a rigid body on a pivot.

    Parameters
    ----------
    inertia_kgm2, damping_Nms_per_rad, stiffness_Nm_per_rad
        I_i, c_i and k_i of eqs. (1) and (2).
    """

    inertia_kgm2: float
    damping_Nms_per_rad: float
    stiffness_Nm_per_rad: float

    @property
    def natural_frequency_Hz(self) -> float:
        """Undamped frequency of the free arm."""
        return math.sqrt(self.stiffness_Nm_per_rad / self.inertia_kgm2) / (2 * math.pi)

    @property
    def quality_factor(self) -> float:
        """Quality factor of the free arm."""
        return math.sqrt(self.inertia_kgm2 * self.stiffness_Nm_per_rad) / self.damping_Nms_per_rad


@dataclass(frozen=True)
class Gripper:
    """The chain A-B-C-D: left arm AB (index 2), right arm DC (index 4), sample BC.

    Parameters
    ----------
    arm_length_m
        Length l of both arms.
    reference_angle_deg
        hat-theta_2, the left arm's angle when the jaws just touch the sample;
        the right arm stands at 180 degrees minus it.
    left, right
        The arms.
    """

    arm_length_m: float
    reference_angle_deg: float
    left: Arm
    right: Arm

    @property
    def lever_m(self) -> float:
        """Tip displacement per closing rotation at the reference, l sin(hat-theta_2)."""
        return self.arm_length_m * math.sin(math.radians(self.reference_angle_deg))

    @property
    def jaw_stiffness_N_per_m(self) -> float:
        """Stiffness of both hinges as the sample meets it: force over the closing of the jaws."""
        yielding = 1 / self.left.stiffness_Nm_per_rad + 1 / self.right.stiffness_Nm_per_rad
        return 1 / (self.lever_m**2 * yielding)
