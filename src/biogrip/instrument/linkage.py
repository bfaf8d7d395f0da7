"""The linkage: rotation of an arm and displacement of its tip."""

import numpy as np

from biogrip.arrays import Array
from biogrip.instrument.gripper import Gripper


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


def displacement_of_tip(gripper: Gripper, rotation_rad: Array) -> Array:
    """Return the displacement in m of a tip whose arm turns, u = l [cos(hat - phi) - cos hat]."""
    angle = np.radians(gripper.reference_angle_deg)
    half = 0.5 * rotation_rad
    moved: Array = 2 * gripper.arm_length_m * np.sin(angle - half) * np.sin(half)
    return moved
