"""Config blocks of a case, what the paper reports of it, and those that a study sets for all.

A case has all blocks of the study, merged with its own. Beside the bounds of single keys, its
blocks must fit each other: protocol and readings to the instrument, true values to what is
searched, sampling to the protocol.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, Tag

from biogrip.config.messages import checked
from biogrip.config.source import overlaid
from biogrip.config.trace_blocks import ExperimentBlocks, IntervalBlock, SampleBlocks
from biogrip.digits import counted
from biogrip.fit.problem import GeneRange
from biogrip.keys import BY_KIND, Block, Complaint, OneOf, Printed, below, plain
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.gripper import Gripper
from biogrip.physics.noise import MOST_SAMPLES
from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip_study.gripper.calibration import CalibrationTest
from biogrip_study.methods.registry import METHODS

CALIBRATED = "calibrated"

_MOST_SAMPLES_OF_TRACE = 10_000_000

_AnyGripper = Annotated[
    Annotated[dict[str, Any], Tag("a block of keys")] | Annotated[str, Tag("text")], BY_KIND
]


_Parameter = Annotated[str, OneOf(tuple(parameter.name for parameter in SINGLE_BRANCH))]
_PrintedError = Annotated[
    str,
    Field(
        pattern=r"^[<>]?[+-]?[0-9]{1,6}(\.[0-9]{1,3})?$",
        json_schema_extra={
            "form": "a number of at most 12 characters, with < or > before it where the paper has "
            "it"
        },
    ),
]


@dataclass(frozen=True, kw_only=True)
class Published(Block):
    """Results of the paper for a sample, to compare with."""

    table: Annotated[int | None, Field(ge=1, le=1000)]
    """Number of the paper's table."""
    figure: Annotated[int | None, Field(ge=1, le=1000)] = None
    """Number of the paper's figure of the fit."""
    axis_rad: Annotated[
        tuple[Annotated[float, Field(ge=-10, le=10)], ...], Field(min_length=2, max_length=2)
    ] = ()
    """Ends of the rotation axis of the paper's figure."""
    identified: Mapping[_Parameter, Annotated[float, Field(ge=0, le=1e12)]]
    """Identified parameters as printed, SI units."""
    error_percent: Mapping[_Parameter, _PrintedError]
    """Their errors in percent as printed, in quotes, for some are no numbers."""


UNPUBLISHED = Published(table=None, identified={}, error_percent={})
"""Record of a sample that the paper does not have."""


@dataclass(frozen=True)
class Equations(Block):
    """Equations solved to simulate targets; fits solve the linear ones."""

    target: Literal["linear", "nonlinear"]
    """`linear`: corrected eqs. (4)-(6); `nonlinear`: corrected eqs. (1)-(3)."""


@dataclass(frozen=True, kw_only=True)
class Identifiability(IntervalBlock):
    """Settings of the identifiability analysis."""

    coverage_seeds: Annotated[int, Field(ge=0, le=1_000_000)]
    """Number of seeds for which intervals are compared with the true values, and the spread with
    the Cramér-Rao bound, if there is noise; 0 leaves that out."""
    verdicts_every: Annotated[int, Field(ge=1, le=1_000_000)] = 5
    """One in so many of these seeds also gets the verdicts that users are shown, from whole
    profiles, by default 5; a table counts them."""


def _of_methods() -> type[Block]:
    """Make the class of the blocks of all methods; one whose keys have defaults may be left out."""

    def default(kind: Any) -> Any:
        needed = [key for key in fields(kind) if key.default is key.default_factory is MISSING]
        return field() if needed else field(default_factory=kind)

    kinds = {method.key: method.settings for method in METHODS.values()}
    blocks = [(name, kind, default(kind)) for name, kind in kinds.items()]
    return make_dataclass("_MethodBlocks", blocks, bases=(Block,), frozen=True, kw_only=True)


if TYPE_CHECKING:

    class _MethodBlocks(Block): ...
else:
    _MethodBlocks = _of_methods()


@dataclass(frozen=True, kw_only=True)
class Shared(_MethodBlocks, ExperimentBlocks):
    """Blocks that a study sets for all cases, and that a case may change for itself."""

    models: Equations
    calibration: CalibrationTest
    """The no-load test of each arm (end of section 2), for cases whose assumed_gripper is
    `calibrated`."""
    identifiability: Identifiability

    def method(self, name: str) -> Any:
        """Return the settings of a method."""
        return getattr(self, METHODS[name].key)


OVERRIDABLE = tuple(block.name for block in fields(Shared))
"""Blocks that a study sets for all cases, those of methods among them, and that a case may change
for itself."""


@dataclass(frozen=True, kw_only=True)
class CaseBlock(Shared, SampleBlocks):
    """A sample, with all that its experiment and identification need."""

    title: Printed | None = None
    """Name in print, of letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning with a
    space, + or -; by default the case's name."""
    published: Published | None = None
    """Results that the paper reports for this sample, to compare with."""
    contact: Literal["bilateral", "unilateral"] | None = None
    """`bilateral`: the jaws can pull the sample (adhesion), as in the paper's equations;
    `unilateral`: contact is lost where the force reaches zero, the free sample recovers, and
    contact may return. It holds for the target only, whose model must be linear; identification
    always assumes bilateral contact. By default bilateral."""
    assumed_gripper: _AnyGripper | None = None
    """Gripper that the identification assumes, if it differs from the true one: keys of a gripper
    block (with the angle at contact), or `calibrated` for the result of a no-load test."""

    def complaints(self) -> Iterator[Complaint]:
        """Find blocks that are in conflict."""
        yield from super().complaints()
        yield from self._instrument_complaints()
        if self.sample.sample.model.power_law and not self.recorded:
            yield from self._band_complaints()
        if self.assumed_gripper == CALIBRATED:
            arms = self.gripper.left, self.gripper.right
            yield from below(("calibration",), self.calibration.complaints_of(arms))
        elif isinstance(self.assumed_gripper, str):
            text = f"found '{self.assumed_gripper}', allowed is '{CALIBRATED}'"
            yield ("assumed_gripper",), f"{text} or keys of a gripper block."
        elif self.assumed_gripper is not None:
            believed = overlaid(plain(self.gripper.neutral), self.assumed_gripper)
            yield from below(("assumed_gripper",), checked(Gripper, believed)[1])
        if self.recorded:
            if self.contact is not None:
                yield ("contact",), "is only for a simulated case; leave it out of a recorded one."
            return
        yield from self._unreachable_complaints()
        yield from below(("measurement",), self._sampling_complaints())
        if self.contact == "unilateral" and self.models.target != "linear":
            text = "found unilateral and a nonlinear target, allowed is models.target: linear"
            yield ("contact",), f"{text} with it."

    def _instrument_complaints(self) -> Iterator[Complaint]:
        """Find equations and blocks that are not of the kind of instrument."""
        used = self.instrument_used
        if used.has_jaws:
            return
        if used.sweeps and not self.recorded:
            yield ("instrument",), f"found {self.instrument}, allowed in a simulation are others."
        for key, value in vars(self.models).items():
            if value != "linear":
                yield ("models", key), f"found {value}, allowed with {self.instrument} is linear."
        of_gripper = {("contact",): self.contact, ("assumed_gripper",): self.assumed_gripper}
        for path, given in of_gripper.items():
            if given is not None:
                yield path, f"is of the gripper; leave it out with {self.instrument}."

    def _unreachable_complaints(self) -> Iterator[Complaint]:
        """Find true values outside the decades that are searched."""
        for parameter in self.searched:
            value = self.sample.parameters.get(parameter.name)
            genes: GeneRange = getattr(self.search_range, parameter.range_name)
            low = 10.0 ** math.floor(math.log10(genes.low))
            high = 10.0 ** math.ceil(math.log10(genes.high))
            vanishes = value == 0 and parameter.may_vanish
            if value is not None and not vanishes and not low <= value <= high:
                limits = f"{low:g} to {high:g} {parameter.unit}".rstrip()
                text = f"found {value:g}, which is not searched for; allowed is {limits}"
                yield ("sample", parameter.name), f"{text}, or another search_range."

    def _band_complaints(self) -> Iterator[Complaint]:
        """Find times outside the validity of power laws."""
        end_s, rate_Hz, model = self.protocol.end_s, self.measurement.rate_Hz, self.sample.model
        if end_s > LONGEST_S:
            text = f"found a protocol of {end_s:g} s, allowed are at most {LONGEST_S:g} s"
            yield ("sample", "model"), f"{text} with {model}."
        if rate_Hz * SHORTEST_S > 1:
            text = f"found {rate_Hz:g}, allowed is at most {1 / SHORTEST_S:g} Hz with {model}."
            yield ("measurement", "rate_Hz"), text

    def _sampling_complaints(self) -> Iterator[Complaint]:
        measured = self.measurement
        samples = self.protocol.end_s * measured.rate_Hz + 1
        needed = len(self.searched) + sum(measured.along.values()) + 1
        most = MOST_SAMPLES if measured.coloured else _MOST_SAMPLES_OF_TRACE
        if not needed <= samples <= most:
            said = f"found {measured.rate_Hz:g}, which gives {counted(f'{samples:.6g}', 'sample')}"
            how = " with a coloured noise model" if measured.coloured else ""
            yield ("rate_Hz",), f"{said} over the protocol; allowed are {needed} to {most}{how}."
