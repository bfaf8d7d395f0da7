"""Config block of the gripper."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.instrument.actuator import CombDrive, torque_uncertainty
from biogrip.instrument.calibrated_gripper import ARM_KEYS
from biogrip.instrument.contact import Contact, contact
from biogrip.instrument.gripper import Gripper
from biogrip.keys import Block, OneOf, Problem

# Share of a property; a larger change of the response would not be linear.
_MOST_UNCERTAIN = 0.5
_OWN = ("arm_length_m", "reference_angle_deg")
_OF_COMB = ("finger_gap_m", "thickness_m")

_Uncertainties = Mapping[Annotated[str, OneOf(ARM_KEYS)], Annotated[float, Field(ge=0, le=1e3)]]


@dataclass(frozen=True)
class Uncertainty(Block):
    """Standard uncertainties of the gripper; all intervals include them."""

    left: _Uncertainties | None = None
    """Uncertainties of the left arm's keys."""
    right: _Uncertainties | None = None
    """Uncertainties of the right arm's keys."""
    arm_length_m: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Uncertainty of the length of both arms."""
    reference_angle_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Uncertainty of the reference angle. At 90 degrees it has no effect."""
    torque_percent: Annotated[float, Field(ge=0, le=50)] = 0.0
    """Uncertainty of the torque, a factor that both arms and all phases share."""
    voltage_percent: Annotated[float, Field(ge=0, le=25)] = 0.0
    """Uncertainty of the voltage, a factor likewise. This key and the next two are for a protocol
    in voltages: the uncertainties of its torques (eq. 9) add up in quadrature."""
    finger_gap_m: Annotated[float, Field(ge=0, le=1e-2)] = 0.0
    """Uncertainty of the comb drives' gap. The mask fixes the pitch, so that a wider gap is a
    narrower finger."""
    thickness_m: Annotated[float, Field(ge=0, le=1e-2)] = 0.0
    """Uncertainty of the height of the comb drives' fingers."""

    @property
    def by_part(self) -> dict[str, Mapping[str, float]]:
        """Uncertainties of the arms and of the gripper's own keys, as far as they are given."""
        own = {key: known for key in _OWN if (known := getattr(self, key))}
        parts = {"left": self.left, "right": self.right, "gripper": own}
        return {name: known for name, known in parts.items() if known}

    def torque_share(self, comb: CombDrive) -> float:
        """Return the relative standard uncertainty of the torque."""
        of_comb = torque_uncertainty(
            comb, 0.01 * self.voltage_percent, self.finger_gap_m, self.thickness_m
        )
        return math.hypot(0.01 * self.torque_percent, of_comb)


@dataclass(frozen=True)
class GripperBlock(Gripper):
    """The gripper's two arms and jaw gap (Table 1)."""

    jaw_gap_m: Annotated[float, Field(ge=1e-9, le=1.0)]
    """Distance between the jaws in the neutral configuration."""
    uncertainty: Uncertainty | None = None

    def uncertainties(self, comb: CombDrive) -> dict[str, Mapping[str, float]]:
        """Return standard uncertainties by part of the gripper, see `CaseProblem`."""
        if self.uncertainty is None:
            return {}
        share = self.uncertainty.torque_share(comb)
        return self.uncertainty.by_part | ({"torque": {"share": share}} if share else {})

    def problems(self) -> Iterator[Problem]:
        """Refuse uncertainties of half a property or more."""
        for part, known in self.uncertainty.by_part.items() if self.uncertainty else ():
            owner, path = (self, ()) if part == "gripper" else (getattr(self, part), (part,))
            for key, uncertainty in known.items():
                yield from _too_uncertain(("uncertainty", *path, key), uncertainty, owner)

    def comb_problems(self, comb: CombDrive, *, in_volts: bool) -> Iterator[Problem]:
        """Refuse uncertainties of half the comb's size or more, or without voltages."""
        for key in ("voltage_percent", *_OF_COMB) if self.uncertainty else ():
            known, path = getattr(self.uncertainty, key), ("uncertainty", key)
            if known and not in_volts:
                text = "needs a protocol in voltages; allowed with torques is torque_percent."
                yield path, text
            elif key in _OF_COMB:
                yield from _too_uncertain(path, known, comb)

    @property
    def neutral(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return Gripper(self.arm_length_m, self.reference_angle_deg, self.left, self.right)

    def contact(self, comb: CombDrive, size_m: float) -> Contact:
        """Return the gripper's state when it is closed onto a sample."""
        return contact(self.neutral, self.jaw_gap_m, comb, size_m)


def _too_uncertain(path: tuple[str, ...], uncertainty: float, owner: object) -> Iterator[Problem]:
    value = getattr(owner, path[-1])
    if uncertainty >= _MOST_UNCERTAIN * value:
        yield path, f"found {uncertainty:g}, allowed is less than half of {value:g}."
