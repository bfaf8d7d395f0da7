"""From plain config blocks to the objects of the field."""

from collections.abc import Mapping
from typing import Any

from biogrip.actuator import CombDrive
from biogrip.gripper import Arm, Gripper
from biogrip.identify.genetic import GeneticSettings
from biogrip.identify.genome import GeneRange
from biogrip.protocol import Phase


def gripper(block: Mapping[str, Any]) -> Gripper:
    """Build the gripper of a ``gripper`` block."""
    return Gripper(
        block["arm_length_m"],
        block["reference_angle_deg"],
        Arm(**block["left"]),
        Arm(**block["right"]),
    )


def comb_drive(block: Mapping[str, Any]) -> CombDrive:
    """Build the comb drive of an ``actuator`` block."""
    return CombDrive(**block)


def phases(block: Mapping[str, Any]) -> tuple[Phase, ...]:
    """Build the phases of a ``protocol`` block."""
    return tuple(
        Phase(
            phase["duration_s"],
            phase["torque_Nm"],
            phase.get("torque_right_Nm", phase["torque_Nm"]),
        )
        for phase in block["phases"]
    )


def gene_ranges(block: Mapping[str, Any]) -> dict[str, GeneRange]:
    """Build the gene ranges of a ``search_range`` block."""
    return {
        name: GeneRange(tuple(genes["exponent"]), tuple(genes["digit"]))
        for name, genes in block.items()
    }


def genetic_settings(block: Mapping[str, Any]) -> GeneticSettings:
    """Build the settings of a ``genetic_algorithm`` block."""
    return GeneticSettings(**block)
