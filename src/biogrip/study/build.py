"""From plain config blocks to the objects of the field."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from biogrip.experiment.protocol import Harmonic, Load, Phase
from biogrip.experiment.sample import SampleModel, model_named
from biogrip.identify.genome import GeneRange
from biogrip.instrument.actuator import CombDrive, capacitance_slope
from biogrip.instrument.contact import Contact, contact
from biogrip.instrument.gripper import Arm, Gripper


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


def contact_of(
    gripper_block: Mapping[str, Any], actuator: Mapping[str, Any], size_m: float
) -> Contact:
    """Close a gripper, given in its neutral configuration, onto a sample."""
    neutral, comb = gripper(gripper_block), comb_drive(actuator)
    return contact(neutral, gripper_block["jaw_gap_m"], comb, size_m)


def sample_model(settings: Mapping[str, Any]) -> SampleModel:
    """Build the sample model of ``model`` and ``branches``."""
    return model_named(settings["model"], settings.get("branches", 1))


def phases(protocol: Mapping[str, Any], actuator: Mapping[str, Any]) -> tuple[Phase, ...]:
    """Build the phases of a ``protocol`` block, voltages turned into torques (eq. 9)."""
    per_square_volt = 0.5 * capacitance_slope(comb_drive(actuator))
    return tuple(_phase(phase, per_square_volt) for phase in protocol["phases"])


def gene_ranges(block: Mapping[str, Any]) -> dict[str, GeneRange]:
    """Build the gene ranges of a ``search_range`` block."""
    return {
        name: GeneRange(tuple(genes["exponent"]), tuple(genes["digit"]))
        for name, genes in block.items()
    }


def _phase(phase: Mapping[str, Any], per_square_volt: float) -> Phase:
    if "voltage_V" in phase:
        left = _load(phase, "voltage_V", "V")
        right = replace(left, value_Nm=phase.get("voltage_right_V", left.value_Nm))
        left, right = (_squared(load, per_square_volt) for load in (left, right))
    else:
        left = _load(phase, "torque_Nm", "Nm")
        right = replace(left, value_Nm=phase.get("torque_right_Nm", left.value_Nm))
    return Phase(phase["duration_s"], left, right)


def _load(phase: Mapping[str, Any], key: str, unit: str) -> Load:
    """A hold, a ramp or a sinusoid that starts at its mean, rising."""
    value = phase[key]
    slope = (phase.get(f"to_{key}", value) - value) / phase["duration_s"]
    harmonics: tuple[Harmonic, ...] = ()
    if f"amplitude_{unit}" in phase:
        omega = 2 * math.pi * phase["frequency_Hz"]
        harmonics = (Harmonic(phase[f"amplitude_{unit}"], omega, -math.pi / 2),)
    return Load(value, slope, 0.0, harmonics)


def _squared(volts: Load, per_square_volt: float) -> Load:
    """Torque of a voltage V + r t, or V + A sin(omega t), by tau = kappa V^2.

    The squared sinusoid is V^2 + A^2/2 + 2 V A sin(omega t) - A^2/2 cos(2 omega t).
    """
    kappa, value = per_square_volt, volts.value_Nm
    mean = value**2
    harmonics: list[Harmonic] = []
    for h in volts.harmonics:
        a, omega = h.amplitude_Nm, h.omega_rad_per_s
        mean += a**2 / 2
        harmonics.append(Harmonic(2 * kappa * value * a, omega, h.phase_rad))
        harmonics.append(Harmonic(kappa * a**2 / 2, 2 * omega, math.pi))
    return Load(
        kappa * mean,
        2 * kappa * value * volts.slope_Nm_per_s,
        2 * kappa * volts.slope_Nm_per_s**2,
        tuple(harmonics),
    )
