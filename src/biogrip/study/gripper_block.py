"""Config block of the gripper."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.calibrated_gripper import ARM_KEYS
from biogrip.instrument.contact import Contact, contact
from biogrip.instrument.gripper import Gripper
from biogrip.keys import Block, OneOf, Problem

# Share of an arm's property; a larger change of the response would not be linear.
_MOST_UNCERTAIN = 0.5

_Uncertainties = Mapping[Annotated[str, OneOf(ARM_KEYS)], Annotated[float, Field(ge=0, le=1e3)]]


@dataclass(frozen=True)
class Uncertainty(Block):
    """Standard uncertainties of a calibrated gripper, arm by arm; all intervals include them."""

    left: _Uncertainties | None = None
    """Uncertainties of the left arm's keys."""
    right: _Uncertainties | None = None
    """Uncertainties of the right arm's keys."""


@dataclass(frozen=True)
class GripperBlock(Gripper):
    """The gripper's two arms and jaw gap (Table 1)."""

    jaw_gap_m: Annotated[float, Field(ge=1e-9, le=1.0)]
    """Distance between the jaws in the neutral configuration."""
    uncertainty: Uncertainty | None = None

    @property
    def uncertainties(self) -> dict[str, Mapping[str, float]]:
        """Standard uncertainties by arm and key."""
        if self.uncertainty is None:
            return {}
        return {name: known for name, known in vars(self.uncertainty).items() if known}

    def problems(self) -> Iterator[Problem]:
        """Refuse uncertainties of half an arm's property or more."""
        for name, known in self.uncertainties.items():
            for key, uncertainty in known.items():
                value = getattr(getattr(self, name), key)
                if uncertainty >= _MOST_UNCERTAIN * value:
                    text = f"found {uncertainty:g}, allowed is less than half of {value:g}."
                    yield ("uncertainty", name, key), text

    @property
    def neutral(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return Gripper(self.arm_length_m, self.reference_angle_deg, self.left, self.right)

    def contact(self, comb: CombDrive, size_m: float) -> Contact:
        """Return the gripper's state when it is closed onto a sample."""
        return contact(self.neutral, self.jaw_gap_m, comb, size_m)
