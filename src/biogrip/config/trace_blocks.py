"""Config blocks of a sample and its experiment, and all that a trace may be asked.

The gripper has two arms, a jaw gap, and standard uncertainties. The protocol says what is
controlled over time: torques or voltages of the comb drives or, of another instrument, a load or a
deformation. The sample is a constitutive model with the true values of its parameters.

Beside the bounds of single keys, the blocks must fit each other: protocol and readings to the
instrument, known parameters to the sample's model.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, Field

from biogrip.errors import BiogripError, nearest
from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.problem import SearchRange
from biogrip.keys import OPEN, Block, Checked, Complaint, Distinct, OneOf, below, formed
from biogrip.physics.gripper import (
    ARM_KEYS,
    LARGEST_M,
    SMALLEST_M,
    CombDrive,
    Contact,
    Gripper,
    capacitance_slope,
    find_contact,
)
from biogrip.physics.instruments import CONTROLLED, GRIPPER, KINDS, Instrument, of_kind
from biogrip.physics.models import ALIASES, CANDIDATES, MODELS, Sample
from biogrip.physics.protocol import Phase, hold, largest_load, ramp
from biogrip.physics.sample_model import MOST_BRANCHES, Parameter, SampleModel
from biogrip.traces.measurement_block import MeasurementBlock

LARGEST_PARAMETER = 1e12
_LEAST_PARAMETER = 1e-18
SHORTEST_S, LONGEST_S = 1e-6, 1e9
_VOLTAGE = "voltage_V"
# Keys that say what is controlled; with the first two a comb drive pulls.
_BASES = (CONTROLLED[0].column, _VOLTAGE, *(each.column for each in CONTROLLED[1:]))
_PULLS = _BASES[:2]
# Share of a property; a larger change of the response would not be linear.
_MOST_UNCERTAIN = 0.5
_OF_BOTH = ("arm_length_m", "reference_angle_deg")

USUAL_NAMES = BeforeValidator(
    lambda name: ALIASES.get(name.lower(), name) if isinstance(name, str) else name
)
"""Annotation of a model's name, which may be a usual one, as SLS."""

_SAID_NEAREST = Field(json_schema_extra={"usual": [*ALIASES, "jeffreys"]})
# A load or a deformation, either way.
_SMALLEST = 1e-50
_Signed = Annotated[float | None, Field(ge=-1e12, le=1e12)]
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
    """Uncertainty of the torque, a factor that both arms and all phases share; twice that of a
    voltage."""

    @property
    def by_part(self) -> dict[str, Mapping[str, float]]:
        """Uncertainties by part and key, as far as they are given, see `Experiment`."""
        both = {key: known for key in _OF_BOTH if (known := getattr(self, key))}
        torque = {"share": 0.01 * self.torque_percent} if self.torque_percent else None
        parts = {"left": self.left, "right": self.right, "gripper": both, "torque": torque}
        return {name: known for name, known in parts.items() if known}


@dataclass(frozen=True)
class GripperBlock(Gripper):
    """The gripper's two arms and jaw gap (Table 1)."""

    jaw_gap_m: Annotated[float, Field(ge=1e-9, le=1.0)]
    """Distance between the jaws in the neutral configuration."""
    uncertainty: Uncertainty | None = None

    def complaints(self) -> Iterator[Complaint]:
        """Refuse uncertainties of half a property or more."""
        for part, known in self.uncertainty.by_part.items() if self.uncertainty else ():
            if part == "torque":
                continue
            owner, path = (self, ()) if part == "gripper" else (getattr(self, part), (part,))
            for key, uncertainty in known.items():
                if uncertainty >= _MOST_UNCERTAIN * (value := getattr(owner, key)):
                    text = f"found {uncertainty:g}, allowed is less than half of {value:g}."
                    yield ("uncertainty", *path, key), text

    @property
    def neutral(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return Gripper(self.arm_length_m, self.reference_angle_deg, self.left, self.right)

    def contact(self, comb: CombDrive, size_m: float) -> Contact:
        """Return the gripper's state when it is closed onto a sample."""
        return find_contact(self.neutral, self.jaw_gap_m, comb, size_m)


@dataclass(frozen=True)
class PhaseBlock(Block):
    """A phase of the protocol: a hold or a ramp, of one quantity in all phases."""

    duration_s: Annotated[float, Field(ge=SHORTEST_S, le=LONGEST_S)]
    """Duration of the phase; of all together at most 1e9 s."""
    torque_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Closing torque of both arms, held or, with to_torque_Nm, at the start of a ramp."""
    to_torque_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Torque at the end of a ramp."""
    voltage_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Voltage on both comb drives, instead of torque_Nm. As in the paper, eq. (9) converts it to
    grip torque, counted from contact; the voltage that closes the jaws onto a sample comes on
    top."""
    to_voltage_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Voltage at the end of a ramp of the voltage."""
    force_N: _Signed = None
    """Force on the sample, instead of torque_Nm, where the instrument is `creep`; so is stress_Pa.
    Where it is `relaxation`, displacement_m or strain."""
    to_force_N: _Signed = None
    """Force at the end of a ramp."""
    stress_Pa: _Signed = None
    """Stress on the sample."""
    to_stress_Pa: _Signed = None
    """Stress at the end of a ramp."""
    displacement_m: _Signed = None
    """Displacement of the sample."""
    to_displacement_m: _Signed = None
    """Displacement at the end of a ramp, as the ramp of loading."""
    strain: _Signed = None
    """Strain of the sample."""
    to_strain: _Signed = None
    """Strain at the end of a ramp, as the ramp of loading."""

    @property
    def bases(self) -> list[str]:
        """Keys that say what is controlled; in a valid phase, one."""
        return [key for key in _BASES if getattr(self, key) is not None]

    @property
    def drives(self) -> bool:
        """True if anything that the phase controls differs from zero."""
        return any(vars(self)[key] for key in vars(self).keys() - {"duration_s"})

    def phase(self, per_square_volt: float) -> Phase:
        """Return the phase in torques; a voltage's torque is `per_square_volt` V^2 (eq. 9)."""
        (base,) = self.bases
        level, to_level = getattr(self, base), getattr(self, f"to_{base}")
        held = to_level is None
        phase = hold(self.duration_s, level) if held else ramp(self.duration_s, level, to_level)
        return phase.squared(per_square_volt) if base == _VOLTAGE else phase

    def complaints(self) -> Iterator[Complaint]:
        """Find keys that are in conflict."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        if len(self.bases) != 1:
            found, others = " and ".join(self.bases) or "neither", ", ".join(_BASES[2:])
            text = f"found {found}, allowed is one of {' and '.join(_PULLS)}, or with another "
            yield (), f"{text}instrument of {others}."
            return
        by = self.bases[0]
        for key in sorted(given.keys() - {"duration_s", by, f"to_{by}"}):
            yield (key,), f"does not go with {by}."
        for key in (by, f"to_{by}"):
            # Their squares would have no digits left.
            if 0 < abs(given.get(key, 0)) < _SMALLEST:
                yield (key,), f"found {given[key]:g}, allowed is 0, or at least {_SMALLEST:g}."


@dataclass(frozen=True)
class ProtocolBlock(Block):
    """Torques or voltages of the comb drives over time (Figure 3)."""

    phases: Annotated[tuple[PhaseBlock, ...], Field(min_length=1, max_length=1000)]
    """Phases that follow one another from t = 0; the experiment ends with the last."""

    @property
    def end_s(self) -> float:
        """Duration of the protocol."""
        return sum(phase.duration_s for phase in self.phases)

    def make_phases(self, instrument: Instrument, comb: CombDrive) -> tuple[Phase, ...]:
        """Return all phases in units of what the instrument controls, or of the largest load."""
        per_square_volt = 0.5 * capacitance_slope(comb)
        phases = tuple(phase.phase(per_square_volt) for phase in self.phases)
        if not instrument.relative:
            return phases
        return tuple(phase.divided(largest_load(phases)) for phase in phases)

    def complaints(self) -> Iterator[Complaint]:
        """Refuse a protocol that is too long, or in which all torques are zero."""
        if self.end_s > LONGEST_S:
            text = f"found {self.end_s:g} s in all phases together"
            yield ("phases",), f"{text}, allowed is at most {LONGEST_S:g} s."
        if not any(phase.drives for phase in self.phases):
            name = self.phases[0].bases[0].partition("_")[0]
            text = f"no phase has a {name}, so nothing would move; allowed is at least one above 0."
            yield ("phases",), text

    def instrument_complaints(self, instruments: Sequence[Instrument]) -> Iterator[Complaint]:
        """Find phases that control what none of some instruments, of one kind, does."""
        columns = list(dict.fromkeys(instrument.controlled.column for instrument in instruments))
        allowed = [*columns, _VOLTAGE] if _BASES[0] in columns else columns
        for index, phase in enumerate(self.phases):
            for base in phase.bases:
                if base not in allowed:
                    text = f"is not what {instruments[0].kind} holds; allowed is "
                    yield ("phases", index, base), f"{text}{' or '.join(allowed)}."
                elif base not in _PULLS and base != self.phases[0].bases[0]:
                    text = f"does not go with {self.phases[0].bases[0]} in another phase; allowed "
                    yield ("phases", index, base), f"{text}is one of them."


class SampleBlock(Checked, BaseModel):
    """Constitutive model of the sample and its true parameters."""

    model_config = OPEN
    __pydantic_extra__: dict[str, Annotated[float, Field(le=LARGEST_PARAMETER)]] = Field(init=False)
    """True values of the model's parameters, by name, SI units."""
    model: Annotated[str, OneOf(MODELS), USUAL_NAMES, _SAID_NEAREST]
    """Constitutive model, see "Sample models" for its parameters."""
    branches: Annotated[int, Field(ge=1, le=MOST_BRANCHES)] = 1
    """Number of Maxwell branches of `generalized_maxwell`; with more than one, its parameters are
    k_1, k_2, ..., k_p, c_1, c_2, ..., c_p. By default 1."""
    size_m: Annotated[float | None, Field(ge=SMALLEST_M, le=LARGEST_M)] = None
    """Diameter of the sample. It decides at which angle the jaws touch it."""

    @property
    def parameters(self) -> dict[str, float]:
        """True values of the model's parameters, by name."""
        return self.__pydantic_extra__

    @property
    def sample(self) -> Sample:
        """Constitutive model, with its number of branches."""
        return Sample(self.model, self.branches)

    def complaints(self) -> Iterator[Complaint]:
        """Find parameters that the model does not have, or whose values it does not allow."""
        if self.branches != 1 and self.model != "generalized_maxwell":
            yield ("branches",), "only generalized_maxwell has a number of branches."
            return
        model = self.sample.model
        yield from _parameter_complaints(model, self.parameters, model.name)

    def missing(self) -> Iterator[Complaint]:
        """Find parameters of the model without a true value."""
        model = self.sample.model
        for name in model.names:
            if name not in self.parameters:
                yield (name,), f"is missing: {model.name} needs {', '.join(model.names)}."


def _parameter_complaints(
    model: SampleModel, values: Mapping[str, float], called: str
) -> Iterator[Complaint]:
    """Find unknown names, and values out of range; 0 is allowed for those that may vanish."""
    by_name = {parameter.name: parameter for parameter in model.parameters}
    for name, value in values.items():
        if name not in by_name:
            text = f"is no parameter of {called}, which has {', '.join(model.names)}."
            yield (name,), text + nearest(name, model.names)
            continue
        parameter = by_name[name]
        vanishes = value == 0 and parameter.may_vanish
        usual = vanishes or _LEAST_PARAMETER <= value <= LARGEST_PARAMETER
        if not usual or value >= parameter.below:
            zero = "0 or " if parameter.may_vanish else ""
            bounded = parameter.below < LARGEST_PARAMETER
            most = f"below {parameter.below:g}" if bounded else f"at most {LARGEST_PARAMETER:g}"
            text = f"found {value:g}, allowed is {zero}at least {_LEAST_PARAMETER:g} and {most}"
            yield (name,), f"{text} {parameter.unit}".rstrip() + "."


CandidateName = Annotated[str, OneOf(CANDIDATES), USUAL_NAMES]
"""Name of a sample model, with its number of Maxwell branches."""

_CASE = "a letter or digit, then up to 63 of these, '_' or '-'"
CaseName = Annotated[str, formed("^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$", _CASE)]
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
        kind, held = of_kind(self.instrument), self.protocol.phases[0].bases
        fitting = [used for used in kind if used.controlled.column in held] or kind
        readings = self.measurement.readings if self.recorded else []
        return next((used for used in fitting if used.read.name in readings), fitting[0])

    @property
    def searched(self) -> list[Parameter]:
        """Parameters that are identified."""
        return [p for p in self.sample.sample.model.parameters if p.name not in self.fixed]

    def complaints(self) -> Iterator[Complaint]:
        """Find known parameters, a protocol, and readings that do not fit the rest."""
        model = self.sample.sample.model
        yield from below(("fixed",), _parameter_complaints(model, self.fixed, "the sample"))
        if {*model.names} <= self.fixed.keys():
            yield ("fixed",), "leaves nothing to identify; allowed are fewer parameters."
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
