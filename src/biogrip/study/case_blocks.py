"""Config blocks of a case, and those that a study sets for all cases."""

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, GetJsonSchemaHandler, Tag, TypeAdapter, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.experiment.sample import Parameter
from biogrip.experiment.springpot import LONGEST_S, SHORTEST_S
from biogrip.experiment.truth import Published
from biogrip.fit.genome import GeneRange
from biogrip.fit.methods import METHODS, block_class
from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.calibration import CalibrationTest
from biogrip.instrument.gripper import GRIPPER
from biogrip.instrument.instrument import Instrument
from biogrip.instrument.instruments import INSTRUMENTS, KINDS
from biogrip.keys import BY_KIND, OPEN, Block, Checked, OneOf, Printed, Problem
from biogrip.response.whitening import MOST_SAMPLES
from biogrip.study.gripper_block import GripperBlock
from biogrip.study.measurement_block import MeasurementBlock
from biogrip.study.plain import built
from biogrip.study.protocol_block import ProtocolBlock
from biogrip.study.sample_block import LARGEST_PARAMETER, SampleBlock, fixed_problems

METHOD_BLOCKS = tuple(dict.fromkeys(name for it in METHODS.values() for name in it.blocks))
"""Config blocks of the methods."""

CALIBRATED = "calibrated"

_MOST_SAMPLES = 10_000_000

_AnyGripper = Annotated[
    Annotated[dict[str, Any], Tag("a block of keys")] | Annotated[str, Tag("text")], BY_KIND
]


@dataclass(frozen=True)
class SearchRange(Block):
    """Search range of each parameter as allowed values of its genes (Tables 3 and 4)."""

    k: GeneRange
    k_p: GeneRange
    c: GeneRange
    c_p: GeneRange
    alpha: GeneRange

    def problems(self) -> Iterator[Problem]:
        """Refuse a range that has exponents of springpots above 1."""
        highest = self.alpha.exponent[1]
        if highest > 0:
            text = f"found {highest}, which makes exponents of springpots above 1; allowed is at "
            yield ("alpha", "exponent"), f"{text}most 0."


@dataclass(frozen=True)
class Equations(Block):
    """Equations solved to simulate targets and to identify samples."""

    target: Literal["linear", "nonlinear"]
    """`linear`: corrected eqs. (4)-(6); `nonlinear`: corrected eqs. (1)-(3)."""
    identification: Literal["linear", "nonlinear"]
    """The same for the model to fit."""


@dataclass(frozen=True)
class Identifiability(Block):
    """Settings of the identifiability analysis."""

    confidence: Annotated[float, Field(ge=0.5, le=0.99)]
    """Confidence level of all intervals."""
    coverage_seeds: Annotated[int, Field(ge=0, le=1_000_000)]
    """Number of seeds for which intervals are compared with the true values, and the spread with
    the Cramér-Rao bound, if there is noise; 0 leaves that out."""
    verdicts_every: Annotated[int, Field(ge=1, le=1_000_000)] = 25
    """One in so many of these seeds also gets the verdicts that users are shown, from whole
    profiles. By default 25; with 1 a table counts them."""


class Shared(Checked, BaseModel):
    """Blocks that a study sets for all cases, and that a case may change for itself.

    Those of methods are among the extra keys, so that their modules are imported where they are
    used.
    """

    model_config = OPEN

    instrument: Annotated[
        str,
        OneOf(KINDS),
        Field(
            description="`gripper`: a torque is held and a rotation read; `creep`: a force is held "
            "and a displacement read, or a stress and a strain; `relaxation`: the other way round. "
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
        Mapping[str, Annotated[float, Field(ge=0, le=LARGEST_PARAMETER)]] | None,
        Field(
            description="Known values of parameters, by name; these are not identified. 0 leaves "
            "an element out."
        ),
    ] = None

    def method_block(self, name: str) -> object:
        """Return the settings object of a block of a method."""
        return built(block_class(name), (self.__pydantic_extra__ or {}).get(name, {}))

    def method(self, name: str) -> object:
        """Return the settings object of a method."""
        method = METHODS[name]
        found = [self.method_block(block) for block in method.blocks]
        return method.named(method.settings)(*found) if method.settings else found[0]

    @property
    def method_blocks(self) -> dict[str, Any]:
        """Settings objects of all blocks of methods that are valid."""
        found = {}
        for name in METHOD_BLOCKS:
            with suppress(ValidationError):
                found[name] = self.method_block(name)
        return found

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Return the JSON Schema, with the blocks of all methods."""
        ref = handler(schema)
        found = handler.resolve_ref_schema(ref)
        found["additionalProperties"] = False
        for name in METHOD_BLOCKS:
            found["properties"][name] = handler(TypeAdapter(block_class(name)).core_schema)
        return ref


class CaseBlock(Shared):
    """A sample, with all that its experiment and identification need."""

    title: Annotated[
        Printed | None,
        Field(
            description="Name in print, of letters, digits, spaces and . , : ; ( ) + / % ' - _, "
            "not beginning with a space, + or -; by default the case's name."
        ),
    ] = None
    sample: SampleBlock
    published: Annotated[
        Published | None,
        Field(description="Results that the paper reports for this sample, to compare with."),
    ] = None
    contact: Annotated[
        Literal["bilateral", "unilateral"] | None,
        Field(
            description="`bilateral`: the jaws can pull the sample (adhesion), as in the paper's "
            "equations; `unilateral`: contact is lost where the force reaches zero, the free "
            "sample recovers, and contact may return. It holds for the target only, whose model "
            "must be linear; identification always assumes bilateral contact. By default bilateral."
        ),
    ] = None
    assumed_gripper: Annotated[
        _AnyGripper | None,
        Field(
            description="Gripper that the identification assumes, if it differs from the true one: "
            "keys of a gripper block (with the angle at contact), or `calibrated` for the result "
            "of a no-load test."
        ),
    ] = None

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.measurement.file is not None

    @property
    def instrument_used(self) -> Instrument:
        """The instrument, by its kind, and by what the protocol holds and the trace is of."""
        kind = _of_kind(self.instrument)
        bases = self.protocol.phases[0].bases
        fitting = [each for each in kind if each.controlled.column in bases] or kind
        if len(fitting) == 1:
            return fitting[0]
        named = [each for each in fitting if each.read.name in self.measurement.readings]
        return (named or fitting)[0]

    @property
    def known(self) -> Mapping[str, float]:
        """Parameters with known values, which are not identified."""
        return self.fixed or {}

    @property
    def searched(self) -> list[Parameter]:
        """Parameters that are identified."""
        return [p for p in self.sample.sample.model.parameters if p.name not in self.known]

    @property
    def _genes(self) -> int:
        return sum(getattr(self.search_range, p.range_name).digits + 1 for p in self.searched)

    def problems(self) -> Iterator[Problem]:
        """Find blocks that are in conflict."""
        if self.recorded:
            for name in self.sample.parameters:
                text = "is what a recorded trace is to tell; leave it out."
                yield ("sample", name), text
        else:
            for path, text in self.sample.missing():
                yield ("sample", *path), text
            yield from self._unreachable_problems()
        yield from (
            (("fixed", *path), text)
            for path, text in fixed_problems(self.sample.sample.model, self.known)
        )
        yield from self._instrument_problems()
        yield from self._contact_problems()
        yield from self._method_problems()
        if self.sample.sample.model.power_law:
            yield from self._band_problems()
        if not self.recorded:
            yield from self._sampling_problems()
        if isinstance(self.assumed_gripper, str):
            if self.assumed_gripper == CALIBRATED:
                yield from self._calibration_problems()
            else:
                text = f"found '{self.assumed_gripper}', allowed is '{CALIBRATED}' or keys of a "
                yield ("assumed_gripper",), f"{text}gripper block."

    def _instrument_problems(self) -> Iterator[Problem]:
        """Find a protocol, a reading and equations that are not of the kind of instrument."""
        kind = _of_kind(self.instrument)
        for path, text in self.protocol.instrument_problems(kind):
            yield ("protocol", *path), text
        allowed = [each.read.name for each in kind]
        for name in self.measurement.readings if self.recorded else ():
            if name not in allowed:
                text = f"is not what {self.instrument} reads; allowed is {' or '.join(allowed)}."
                yield ("measurement", name), text
            elif name != self.instrument_used.read.name:
                text = (
                    f"is not read where {self.instrument_used.controlled.name} is held; allowed is "
                )
                yield ("measurement", name), f"{text}{self.instrument_used.read.name}."
        if self.instrument_used.has_jaws:
            return
        for key, value in (
            ("target", self.models.target),
            ("identification", self.models.identification),
        ):
            if value != "linear":
                yield ("models", key), f"found {value}, allowed with {self.instrument} is linear."
        for key in ("contact", "assumed_gripper"):
            if getattr(self, key) is not None:
                yield (key,), f"is of the gripper; leave it out with {self.instrument}."
        if self.sample.size_m is not None:
            yield ("sample", "size_m"), f"is of the gripper; leave it out with {self.instrument}."

    def comb_problems(self, comb: CombDrive) -> Iterator[Problem]:
        """Find a sample that does not fit between the jaws, and what is no comb drive's."""
        if not self.instrument_used.has_jaws:
            return
        in_volts = all(phase.voltage_V is not None for phase in self.protocol.phases)
        for path, text in self.gripper.comb_problems(comb, in_volts=in_volts):
            yield ("gripper", *path), text
        if self.sample.size_m is not None:
            try:
                self.gripper.contact(comb, self.sample.size_m)
            except BiogripError as error:
                yield ("sample", "size_m"), str(error)

    def _contact_problems(self) -> Iterator[Problem]:
        if self.contact is not None and self.recorded:
            text = "is only for a simulated case; of a recorded trace leave out what follows."
            yield ("contact",), text
        elif self.contact == "unilateral" and self.models.target != "linear":
            text = "found unilateral and a nonlinear target, allowed is models.target: linear"
            yield ("contact",), f"{text} with it."

    def _method_problems(self) -> Iterator[Problem]:
        """Find settings of methods that conflict with the length of a chromosome."""
        for name, settings in self.method_blocks.items():
            if hasattr(settings, "problems_of"):
                for path, text in settings.problems_of(self._genes):
                    yield (name, *path), text

    def _unreachable_problems(self) -> Iterator[Problem]:
        """Find true values outside the decades that are searched."""
        for parameter in self.searched:
            value = self.sample.parameters.get(parameter.name)
            genes: GeneRange = getattr(self.search_range, parameter.range_name)
            low = 10.0 ** math.floor(math.log10(genes.low))
            high = 10.0 ** math.ceil(math.log10(genes.high))
            vanishes = value == 0 and parameter.may_vanish
            if value is None or vanishes or low <= value <= high:
                continue
            text = f"found {value:g}, which is not searched for; allowed is {low:g} to {high:g} "
            text = f"{text}{parameter.unit}".rstrip()
            yield ("sample", parameter.name), f"{text}, or another search_range."

    def _band_problems(self) -> Iterator[Problem]:
        """Find times outside the validity of power laws."""
        if self.protocol.end_s > LONGEST_S:
            text = f"found a protocol of {self.protocol.end_s:g} s, allowed are at most"
            yield ("sample", "model"), f"{text} {LONGEST_S:g} s with {self.sample.model}."
        if not self.measurement.times_s and self.measurement.rate_Hz * SHORTEST_S > 1:
            text = f"found {self.measurement.rate_Hz:g}, allowed is at most {1 / SHORTEST_S:g} Hz"
            yield ("measurement", "rate_Hz"), f"{text} with {self.sample.model}."

    def _sampling_problems(self) -> Iterator[Problem]:
        measured, end = self.measurement, self.protocol.end_s
        fitted_along = measured.fits_offset + measured.fits_drift
        needed = len(self.searched) + fitted_along + 1
        if measured.bursts:
            yield from self._burst_problems(needed)
            return
        times = measured.times_s
        if not times:
            samples = end * measured.rate_Hz + 1
            most = MOST_SAMPLES if measured.coloured else _MOST_SAMPLES
            if not needed <= samples <= most:
                given = counted(f"{samples:.6g}", "sample")
                text = f"found {measured.rate_Hz:g}, which gives {given} over the "
                how = " with a coloured noise model" if measured.coloured else ""
                allowed = f"protocol; allowed are {needed} to {most}{how}."
                yield ("measurement", "rate_Hz"), text + allowed
            return
        if len(times) < needed:
            text = f"found {len(times)} times, allowed are at least {needed}."
            yield ("measurement", "times_s"), text
        for index, (before, after) in enumerate(pairwise(times), start=1):
            if not before < after <= end:
                text = f"found {after:g}, allowed is later than {before:g} and at most {end:g} s."
                yield ("measurement", "times_s", index), text
                break

    def _burst_problems(self, needed: int) -> Iterator[Problem]:
        bursts = self.measurement.bursts
        samples = sum(burst.samples for burst in bursts)
        if not needed <= samples <= _MOST_SAMPLES:
            text = f"found {counted(samples, 'sample')}, allowed are {needed} to {_MOST_SAMPLES}."
            yield ("measurement", "bursts"), text
            return
        last = -1.0
        for index, burst in enumerate(bursts):
            ends = burst.from_s + (burst.samples - 1) / burst.rate_Hz
            if not last < burst.from_s <= ends <= self.protocol.end_s:
                text = f"found one from {burst.from_s} to {ends} s, allowed is after {max(last, 0)}"
                text += f" and at most until {self.protocol.end_s} s."
                yield ("measurement", "bursts", index), text
                return
            last = ends

    def _calibration_problems(self) -> Iterator[Problem]:
        """Refuse a calibration test that samples a free arm's ringing too slowly or too briefly."""
        test = self.calibration
        arms = self.gripper.left, self.gripper.right
        frequency = max(arm.natural_frequency_Hz for arm in arms)
        if test.rate_Hz < 10 * frequency:
            text = f"found {test.rate_Hz}, allowed is at least ten times the arms' natural"
            yield ("calibration", "rate_Hz"), f"{text} frequency, {10 * frequency:.4g} Hz."
        most = _MOST_SAMPLES / test.rate_Hz
        if not 5 / frequency <= test.duration_s <= most:
            text = f"found {test.duration_s}, allowed is from five periods of the arms' ring, "
            yield ("calibration", "duration_s"), f"{text}{5 / frequency:.3g} s, to {most:.3g} s."


def _of_kind(kind: str) -> list[Instrument]:
    return [each for each in INSTRUMENTS.values() if each.kind == kind]


OVERRIDABLE = (*Shared.model_fields, *METHOD_BLOCKS)
"""Blocks that a study sets for all cases, and that a case may change for itself."""
