"""A calibrated gripper as a file: a config block that can be laid over a study."""

from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from biogrip.errors import BiogripError
from biogrip.instrument.gripper import Arm, Gripper

ARM_KEYS = ("inertia_kgm2", "damping_Nms_per_rad", "stiffness_Nm_per_rad")


@dataclass(frozen=True)
class CalibratedArm:
    """A calibrated arm with its standard uncertainties."""

    arm: Arm
    """Estimates."""
    uncertainty: Arm
    """Their standard uncertainties, in the same units."""


def calibration_yaml(left: CalibratedArm, right: CalibratedArm) -> str:
    """Write the calibrated arms as a config file that can be laid over a study."""
    arms = {"left": left, "right": right}
    block = {
        **{name: _rounded(arm.arm, 7) for name, arm in arms.items()},
        "uncertainty": {name: _rounded(arm.uncertainty, 2) for name, arm in arms.items()},
    }
    return yaml.safe_dump({"gripper": block}, sort_keys=False)


def read_calibrated_arms(
    path: Path, gripper: Gripper
) -> tuple[Gripper, dict[str, dict[str, float]]]:
    """Return a gripper with the arms of a calibration in place of its own.

    Returns
    -------
    gripper
        Gripper with the calibrated arms.
    uncertainty
        Standard uncertainties by arm and key.

    Raises
    ------
    BiogripError
        If the file is missing or is no calibration.
    """
    try:
        block = yaml.safe_load(path.read_text(encoding="utf-8"))["gripper"]
        left, right = (_numbers(block[name]) for name in ("left", "right"))
        uncertainty = {name: _numbers(block["uncertainty"][name]) for name in ("left", "right")}
    except (OSError, yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as a calibration: {error}.") from error
    return replace(gripper, left=Arm(**left), right=Arm(**right)), uncertainty


def _numbers(block: dict[str, float]) -> dict[str, float]:
    return {key: float(block[key]) for key in ARM_KEYS}


def _rounded(arm: Arm, digits: int) -> dict[str, float]:
    return {key: float(f"{getattr(arm, key):.{digits}g}") for key in ARM_KEYS}
