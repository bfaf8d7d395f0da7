"""Config blocks of a case, and those that a study sets for all cases.

A case has all blocks of the study, merged with its own. Beside the bounds of single keys, its
blocks must fit each other: protocol and readings to the instrument, true values to what is
searched, sampling to the protocol.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.fit.differential_evolution import DifferentialEvolutionSettings
from biogrip.fit.genetic import GeneticSettings
from biogrip.fit.genetic_refined import Polishing
from biogrip.fit.genome import GeneRange, SearchRange
from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.problem import METHODS
from biogrip.keys import BY_KIND, Block, Complaint, OneOf, Printed, below, plain
from biogrip.physics.calibration import CalibrationTest
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.gripper import CombDrive, Gripper
from biogrip.physics.instruments import GRIPPER, KINDS, Instrument, of_kind
from biogrip.physics.models import Published
from biogrip.physics.noise import MOST_SAMPLES
from biogrip.physics.sample_model import Parameter
from biogrip.study.experiment_blocks import (
    LARGEST_PARAMETER,
    GripperBlock,
    ProtocolBlock,
    SampleBlock,
    fixed_complaints,
)
from biogrip.study.messages import checked
from biogrip.study.source import overlaid
from biogrip.traces.measurement_block import MeasurementBlock

CALIBRATED = "calibrated"

_MOST_SAMPLES = 10_000_000

_AnyGripper = Annotated[
    Annotated[dict[str, Any], Tag("a block of keys")] | Annotated[str, Tag("text")], BY_KIND
]


@dataclass(frozen=True)
class Equations(Block):
    """Equations solved to simulate targets; fits solve the linear ones."""

    target: Literal["linear", "nonlinear"]
    """`linear`: corrected eqs. (4)-(6); `nonlinear`: corrected eqs. (1)-(3)."""


@dataclass(frozen=True)
class Identifiability(Block):
    """Settings of the identifiability analysis."""

    confidence: Annotated[float, Field(ge=0.5, le=0.99)]
    """Confidence level of all intervals."""
    coverage_seeds: Annotated[int, Field(ge=0, le=1_000_000)]
    """Number of seeds for which intervals are compared with the true values, and the spread with
    the Cramér-Rao bound, if there is noise; 0 leaves that out."""
    verdicts_every: Annotated[int, Field(ge=1, le=1_000_000)] = 5
    """One in so many of these seeds also gets the verdicts that users are shown, from whole
    profiles. By default 5; with 1 a table counts them."""
    at_s: Annotated[
        tuple[Annotated[float, Field(ge=1e-12, le=1e12)], ...], Field(max_length=20)
    ] = ()
    """Times after a step, and inverses of angular frequencies, at which `biogrip identify` tells
    what any linear sample would show. By default one a decade."""


@dataclass(frozen=True, kw_only=True)
class Shared(Block):
    """Blocks that a study sets for all cases, and that a case may change for itself."""

    # With descriptions, for docstrings below fields are not inherited.
    instrument: Annotated[
        str,
        OneOf(KINDS),
        Field(
            description="`gripper`: a torque is held and a rotation read; `creep`: a force is held "
            "and a displacement read, or a stress and a strain; `relaxation`: the other way round; "
            "`oscillation`: a recorded frequency sweep of moduli, for `biogrip identify`. "
            "The blocks gripper, actuator and calibration are of the first alone."
        ),
    ] = GRIPPER.kind
    gripper: GripperBlock
    protocol: ProtocolBlock
    measurement: MeasurementBlock
    search_range: SearchRange
    models: Equations
    calibration: Annotated[
        CalibrationTest,
        Field(
            description="The no-load test of each arm (end of section 2), for cases whose "
            "assumed_gripper is `calibrated`."
        ),
    ]
    identifiability: Identifiability
    fixed: Annotated[
        Mapping[str, Annotated[float, Field(ge=0, le=LARGEST_PARAMETER)]],
        Field(
            description="Known values of parameters, by name; these are not identified. 0 leaves "
            "an element out."
        ),
    ] = field(default_factory=dict)
    # Of the methods, as `METHODS` names them.
    genetic_algorithm: GeneticSettings
    genetic_refined: Polishing
    least_squares: LeastSquaresSettings
    differential_evolution: DifferentialEvolutionSettings

    def method(self, name: str) -> object:
        """Return the settings of a method, of several blocks as a tuple."""
        found = tuple(getattr(self, block) for block in METHODS[name].blocks)
        return found if len(found) > 1 else found[0]


OVERRIDABLE = tuple(each.name for each in fields(Shared))
"""Blocks that a study sets for all cases, those of methods among them, and that a case may change
for itself."""


@dataclass(frozen=True, kw_only=True)
class CaseBlock(Shared):
    """A sample, with all that its experiment and identification need."""

    title: Printed | None = None
    """Name in print, of letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning with a
    space, + or -; by default the case's name."""
    sample: SampleBlock
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

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.measurement.file is not None

    @property
    def instrument_used(self) -> Instrument:
        """The instrument, by its kind, and by what the protocol holds and the trace is of."""
        kind = of_kind(self.instrument)
        bases = self.protocol.phases[0].bases
        fitting = [each for each in kind if each.controlled.column in bases] or kind
        if len(fitting) == 1 or not self.recorded:
            return fitting[0]
        named = [each for each in fitting if each.read.name in self.measurement.readings]
        return (named or fitting)[0]

    @property
    def searched(self) -> list[Parameter]:
        """Parameters that are identified."""
        return [p for p in self.sample.sample.model.parameters if p.name not in self.fixed]

    def complaints(self) -> Iterator[Complaint]:
        """Find blocks that are in conflict."""
        model = self.sample.sample.model
        yield from below(("fixed",), fixed_complaints(model, self.fixed))
        yield from self._instrument_complaints()
        if model.power_law and not self.recorded:
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
            for name in self.sample.parameters:
                yield ("sample", name), "is what a recorded trace is to tell; leave it out."
            if self.contact is not None:
                yield ("contact",), "is only for a simulated case; leave it out of a recorded one."
            return
        yield from below(("sample",), self.sample.missing())
        yield from self._unreachable_complaints()
        yield from below(("measurement",), self._sampling_complaints())
        if self.contact == "unilateral" and self.models.target != "linear":
            text = "found unilateral and a nonlinear target, allowed is models.target: linear"
            yield ("contact",), f"{text} with it."

    def _instrument_complaints(self) -> Iterator[Complaint]:
        """Find a protocol, a reading and equations that are not of the kind of instrument."""
        kind, used = of_kind(self.instrument), self.instrument_used
        yield from below(("protocol",), self.protocol.instrument_complaints(kind))
        for name in self.measurement.readings if self.recorded else ():
            if name != used.read.name:
                text = f"is not what {self.instrument} reads where {used.controlled.name} is held; "
                yield ("measurement", name), f"{text}allowed is {used.read.name}."
        if used.has_jaws:
            return
        if used.sweeps and not self.recorded:
            yield ("instrument",), f"found {self.instrument}, allowed in a simulation are others."
        for key, value in vars(self.models).items():
            if value != "linear":
                yield ("models", key), f"found {value}, allowed with {self.instrument} is linear."
        of_gripper = {
            ("contact",): self.contact,
            ("assumed_gripper",): self.assumed_gripper,
            ("sample", "size_m"): self.sample.size_m,
        }
        for path, given in of_gripper.items():
            if given is not None:
                yield path, f"is of the gripper; leave it out with {self.instrument}."

    def comb_complaints(self, comb: CombDrive) -> Iterator[Complaint]:
        """Find a sample that does not fit between the jaws."""
        if self.instrument_used.has_jaws and self.sample.size_m is not None:
            try:
                self.gripper.contact(comb, self.sample.size_m)
            except BiogripError as error:
                yield ("sample", "size_m"), str(error)

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
        most = MOST_SAMPLES if measured.coloured else _MOST_SAMPLES
        if not needed <= samples <= most:
            found = f"found {measured.rate_Hz:g}, which gives {counted(f'{samples:.6g}', 'sample')}"
            how = " with a coloured noise model" if measured.coloured else ""
            yield ("rate_Hz",), f"{found} over the protocol; allowed are {needed} to {most}{how}."
