"""Config blocks of a sample and its experiment, and all that a trace may be asked.

Beside the bounds of single keys, the blocks must fit each other: protocol and readings to the
instrument, known parameters to the sample's model.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from biogrip.config.experiment_blocks import (
    LARGEST_PARAMETER,
    USUAL_NAMES,
    GripperBlock,
    ProtocolBlock,
    SampleBlock,
    fixed_complaints,
)
from biogrip.errors import BiogripError
from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.problem import SearchRange
from biogrip.keys import Block, Complaint, Distinct, OneOf, below
from biogrip.physics.gripper import CombDrive
from biogrip.physics.instruments import GRIPPER, KINDS, Instrument, of_kind
from biogrip.physics.models import CANDIDATES
from biogrip.physics.sample_model import Parameter
from biogrip.traces.measurement_block import MeasurementBlock

CandidateName = Annotated[str, OneOf(CANDIDATES), USUAL_NAMES]
"""Name of a sample model, with its number of Maxwell branches."""

CaseName = Annotated[
    str,
    Field(
        pattern="^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$",
        json_schema_extra={"form": "a letter or digit, then up to 63 of these, '_' or '-'"},
    ),
]
"""Name of a case."""


@dataclass(frozen=True, kw_only=True)
class IntervalBlock(Block):
    """Settings of the intervals, and of what any linear sample would show."""

    confidence: Annotated[float, Field(ge=0.5, le=0.99)]
    """Confidence level of all intervals."""
    at_s: Annotated[
        tuple[Annotated[float, Field(ge=1e-12, le=1e12)], ...], Field(max_length=20)
    ] = ()
    """Times after a step, and inverses of angular frequencies, at which `biogrip identify` tells
    what any linear sample would show. By default one a decade."""


@dataclass(frozen=True)
class ModelSelection(Block):
    """Selection of the simplest adequate sample model by AIC and BIC."""

    models: Distinct[Annotated[tuple[CandidateName, ...], Field(max_length=100)]]
    """Sample models fitted to every trace, beside that of its case; with an empty list none are. A
    number counts Maxwell branches."""


@dataclass(frozen=True, kw_only=True)
class ExperimentBlocks(Block):
    """Blocks of an experiment, which may be the same for several samples."""

    instrument: Annotated[str, OneOf(KINDS)] = GRIPPER.kind
    """`gripper`: a torque is held and a rotation read; `creep`: a force is held and a displacement
    read, or a stress and a strain; `relaxation`: the other way round; `oscillation`: a recorded
    frequency sweep of moduli, for `biogrip identify`. The blocks gripper, actuator and calibration
    are of the first alone."""
    gripper: GripperBlock
    protocol: ProtocolBlock
    measurement: MeasurementBlock
    search_range: SearchRange
    identifiability: IntervalBlock
    fixed: Mapping[str, Annotated[float, Field(ge=0, le=LARGEST_PARAMETER)]] = field(
        default_factory=dict
    )
    """Known values of parameters, by name; these are not identified. 0 leaves an element out."""
    least_squares: LeastSquaresSettings


@dataclass(frozen=True, kw_only=True)
class SampleBlocks(ExperimentBlocks):
    """A sample, and its experiment."""

    sample: SampleBlock

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.measurement.file is not None

    @property
    def instrument_used(self) -> Instrument:
        """The instrument, by its kind, and by what the protocol holds and the trace is of."""
        kind = of_kind(self.instrument)
        bases = self.protocol.phases[0].bases
        fitting = [some for some in kind if some.controlled.column in bases] or kind
        if len(fitting) == 1 or not self.recorded:
            return fitting[0]
        named = [some for some in fitting if some.read.name in self.measurement.readings]
        return (named or fitting)[0]

    @property
    def searched(self) -> list[Parameter]:
        """Parameters that are identified."""
        return [p for p in self.sample.sample.model.parameters if p.name not in self.fixed]

    def complaints(self) -> Iterator[Complaint]:
        """Find known parameters, a protocol, and readings that do not fit the rest."""
        yield from below(("fixed",), fixed_complaints(self.sample.sample.model, self.fixed))
        kind, used = of_kind(self.instrument), self.instrument_used
        yield from below(("protocol",), self.protocol.instrument_complaints(kind))
        for name in self.measurement.readings if self.recorded else ():
            if name != used.read.name:
                text = f"is not what {self.instrument} reads where {used.controlled.name} is held; "
                yield ("measurement", name), f"{text}allowed is {used.read.name}."
        if not used.has_jaws and self.sample.size_m is not None:
            text = f"is of the gripper; leave it out with {self.instrument}."
            yield ("sample", "size_m"), text
        if self.recorded:
            for name in self.sample.parameters:
                yield ("sample", name), "is what a recorded trace is to tell; leave it out."
        else:
            yield from below(("sample",), self.sample.missing())

    def comb_complaints(self, comb: CombDrive) -> Iterator[Complaint]:
        """Find a sample that does not fit between the jaws."""
        if self.instrument_used.has_jaws and self.sample.size_m is not None:
            try:
                self.gripper.contact(comb, self.sample.size_m)
            except BiogripError as error:
                yield ("sample", "size_m"), str(error)


@dataclass(frozen=True, kw_only=True)
class CommonBlocks(Block):
    """Keys of a config that are the same for all of its samples."""

    actuator: CombDrive
    """The rotary comb drive (Table 2)."""
    model_selection: ModelSelection
    study_seed: Annotated[int, Field(ge=0, le=2**64 - 1)] = 1
    """The one seed. Noise and methods draw from streams derived from it, the case's name and the
    number of the trace."""


@dataclass(frozen=True, kw_only=True)
class TraceConfig(CommonBlocks, SampleBlocks):
    """All keys of what a trace is asked."""

    def complaints(self) -> Iterator[Complaint]:
        """Find blocks that are in conflict, and a sample that does not fit between the jaws."""
        yield from super().complaints()
        yield from self.comb_complaints(self.actuator)
