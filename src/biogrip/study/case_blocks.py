"""The blocks of a case, and of the study for all cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Annotated, Any

from biogrip.errors import BiogripError, nearest
from biogrip.experiment.noise import Noise
from biogrip.experiment.sample import MODELS, MOST_BRANCHES, Parameter, Sample, SampleModel
from biogrip.experiment.truth import Published
from biogrip.identify.genome import GeneRange
from biogrip.identify.methods import METHODS
from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.calibrated_gripper import ARM_KEYS
from biogrip.instrument.calibration import CalibrationTest
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M, Contact, contact
from biogrip.instrument.gripper import Gripper
from biogrip.keys import Key, Problem
from biogrip.study.method_blocks import MethodBlocks
from biogrip.study.protocol_block import ProtocolBlock
from biogrip.study.trace_file import trace_file_problem
from biogrip.traces.recordings import ROTATION_UNITS, TIME_UNITS

PRINTED = Key(
    pattern=r"(?![ +-])[\w .,:;()+/%'-]{1,60}",
    form="text of 1 to 60 letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning with "
    "a space, + or -",
)
"""What a name in print may be."""

EQUATIONS = ("linear", "nonlinear")
CALIBRATED = "calibrated"

_LEAST_PARAMETER = 1e-18
_LARGEST_PARAMETER = 1e12
_MOST_SAMPLES = 10_000_000

_Uncertainties = Annotated[
    Mapping[Annotated[str, Key(choices=ARM_KEYS)], Annotated[float, Key(low=0, high=1e3)]], Key()
]


@dataclass(frozen=True)
class Uncertainty:
    """Standard uncertainties of a calibrated gripper, arm by arm; information only."""

    left: Annotated[_Uncertainties | None, Key("Uncertainties of the left arm's keys.")] = None
    right: Annotated[_Uncertainties | None, Key("Uncertainties of the right arm's keys.")] = None


@dataclass(frozen=True)
class GripperBlock(Gripper):
    """The two arms (Table 1)."""

    jaw_gap_m: Annotated[
        float,
        Key("Distance between the jaws in the neutral configuration.", "m", low=1e-9, high=1.0),
    ]
    uncertainty: Annotated[Uncertainty | None, Key()] = None

    @property
    def neutral(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return Gripper(self.arm_length_m, self.reference_angle_deg, self.left, self.right)

    def contact(self, comb: CombDrive, size_m: float) -> Contact:
        """Close it onto a sample."""
        return contact(self.neutral, self.jaw_gap_m, comb, size_m)


@dataclass(frozen=True, kw_only=True)
class MeasurementBlock:
    """How the left arm's rotation is recorded."""

    rate_Hz: Annotated[
        float, Key("Sampling rate; the first sample is at t = 0.", "Hz", low=1e-9, high=1e9)
    ]
    times_s: Annotated[
        tuple[Annotated[float, Key(low=0, high=1e9)], ...],
        Key(
            "Sampling times, ascending, instead of a uniform rate; for more of them there is "
            "rate_Hz.",
            "s",
            fewest=2,
            most=5000,
        ),
    ] = ()
    file: Annotated[
        str | None,
        Key(
            "A recorded trace, CSV, instead of a simulated one; relative to where Snakemake runs. "
            'See "Your own measurement".',
            fewest=1,
            most=4000,
        ),
    ] = None
    time: Annotated[
        str | None,
        Key(
            "Name of the file's column of times, counted from the start of the protocol.",
            fewest=1,
            most=4000,
        ),
    ] = None
    rotation: Annotated[
        str | None,
        Key("Name of the file's column of the left arm's closing rotation.", fewest=1, most=4000),
    ] = None
    time_unit: Annotated[
        str | None,
        Key(
            "Unit of the times, where the column's name does not end in it.",
            choices=tuple(TIME_UNITS),
        ),
    ] = None
    rotation_unit: Annotated[
        str | None,
        Key(
            "Unit of the rotations, where the column's name does not end in it.",
            choices=tuple(ROTATION_UNITS),
        ),
    ] = None
    noise_rad: Annotated[
        float | None,
        Key(
            "Standard deviation of the recorded noise, if it is known; by default that of the "
            "residual.",
            "rad",
            low=1e-15,
            high=10,
        ),
    ] = None
    offset: Annotated[
        bool,
        Key(
            "Whether the instrument may have added a constant; it is then fitted along. By "
            "default no."
        ),
    ] = False
    drift: Annotated[
        bool,
        Key(
            "Whether the instrument may have added a drift linear in time; it is then fitted "
            "along. By default no."
        ),
    ] = False
    noise: Annotated[Noise, Key()]

    def problems(self) -> Iterator[Problem]:
        """A recorded trace needs a file that is there, and the names of its columns."""
        if self.file is None:
            for key in ("time", "rotation", "time_unit", "rotation_unit", "noise_rad"):
                if getattr(self, key) is not None:
                    yield (key,), "is only for a recorded trace, whose measurement has a file."
            return
        for key in ("time", "rotation"):
            if getattr(self, key) is None:
                yield (key,), f"is missing: a recorded trace needs the name of its {key} column."
        if problem := trace_file_problem(self.file):
            yield ("file",), problem


@dataclass(frozen=True)
class SearchRange:
    """Values that the genes may take (Table 3); Table 4 follows from it."""

    k: Annotated[GeneRange, Key()]
    k_p: Annotated[GeneRange, Key()]
    c: Annotated[GeneRange, Key()]
    c_p: Annotated[GeneRange, Key()]


@dataclass(frozen=True)
class Equations:
    """Which equations are solved, for the targets and in the identification."""

    target: Annotated[
        str,
        Key(
            "`linear`: corrected eqs. (4)-(6); `nonlinear`: corrected eqs. (1)-(3).",
            choices=EQUATIONS,
        ),
    ]
    identification: Annotated[str, Key("The same for the model that is fitted.", choices=EQUATIONS)]


@dataclass(frozen=True)
class Identifiability:
    """How it is judged what a trace determines."""

    confidence: Annotated[float, Key("Confidence of all intervals.", low=0.5, high=0.99)]
    coverage_seeds: Annotated[
        int,
        Key(
            "Over how many seeds intervals and spread are held against truth and bound; 0 leaves "
            "that out.",
            low=0,
            high=1_000_000,
        ),
    ]


@dataclass(frozen=True)
class SampleBlock:
    """The sample's constitutive model and its true parameters."""

    model: Annotated[
        str,
        Key(
            'Constitutive model; which parameters it has is listed under "Sample models".',
            choices=tuple(MODELS),
        ),
    ]
    parameters: Annotated[
        Mapping[str, Annotated[float, Key(high=_LARGEST_PARAMETER)]],
        Key("True values of the model's parameters, by name, SI units.", spread=True),
    ]
    branches: Annotated[
        int,
        Key(
            "Number of Maxwell branches of `generalized_maxwell`; with more than one, its "
            "parameters are k_1, k_2, ..., k_p, c_1, c_2, ..., c_p. By default 1.",
            low=1,
            high=MOST_BRANCHES,
        ),
    ] = 1
    size_m: Annotated[
        float | None,
        Key(
            "Diameter of the sample. Decides where the jaws touch it.",
            "m",
            low=SMALLEST_M,
            high=LARGEST_M,
        ),
    ] = None

    @property
    def sample(self) -> Sample:
        """Which model it has."""
        return Sample(self.model, self.branches)

    def problems(self) -> Iterator[Problem]:
        """Find parameters that its model does not have, or not with such values."""
        if self.branches != 1 and self.model != "generalized_maxwell":
            yield ("branches",), "only generalized_maxwell has a number of branches."
            return
        model = self.sample.model
        for name in self.parameters:
            if name not in model.names:
                text = f"is no parameter of {model.name}, which has {', '.join(model.names)}."
                yield (name,), text + nearest(name, model.names)
        yield from _value_problems(model, self.parameters)

    def missing(self) -> Iterator[Problem]:
        """Find parameters whose true values are not there."""
        model = self.sample.model
        for name in model.names:
            if name not in self.parameters:
                yield (name,), f"is missing: {model.name} needs {', '.join(model.names)}."


def _value_problems(model: SampleModel, values: Mapping[str, float]) -> Iterator[Problem]:
    """Find parameters that are too small, but for those that may vanish."""
    there: list[Parameter] = [p for p in model.parameters if p.name in values]
    for parameter in there:
        value = values[parameter.name]
        if value < _LEAST_PARAMETER and not (value == 0 and parameter.may_vanish):
            zero = "0 or " if parameter.may_vanish else ""
            text = f"found {value}, allowed is {zero}at least {_LEAST_PARAMETER:g}"
            yield (parameter.name,), f"{text} {parameter.unit}."


@dataclass(frozen=True, kw_only=True)
class Shared:
    """Blocks that hold for all cases, and that a case may change for itself."""

    gripper: Annotated[GripperBlock, Key()]
    protocol: Annotated[ProtocolBlock, Key()]
    measurement: Annotated[MeasurementBlock, Key()]
    search_range: Annotated[SearchRange, Key()]
    of_methods: Annotated[MethodBlocks, Key(spread=True)]
    models: Annotated[Equations, Key()]
    calibration: Annotated[
        CalibrationTest,
        Key(
            "The no-load test of each arm (end of section 2), for cases whose assumed_gripper is "
            "`calibrated`."
        ),
    ]
    identifiability: Annotated[Identifiability, Key()]


@dataclass(frozen=True, kw_only=True)
class CaseBlock(Shared):
    """One sample."""

    title: Annotated[
        str | None,
        Key(
            "Name in print, of letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning "
            "with a space, + or -; by default the case's name.",
            pattern=PRINTED.pattern,
            form=PRINTED.form,
        ),
    ] = None
    sample: Annotated[SampleBlock, Key()]
    published: Annotated[
        Published | None, Key("What the paper reports of this sample; data to compare with.")
    ] = None
    fixed: Annotated[
        Mapping[str, Annotated[float, Key(low=0, high=_LARGEST_PARAMETER)]] | None,
        Key("Parameters that are known and not identified, by name, with their values."),
    ] = None
    contact: Annotated[
        str | None,
        Key(
            "`bilateral`: the jaws hold the sample even where they have to pull it (it sticks), as "
            "the paper's equations have it; `unilateral`: where the force reaches zero they leave "
            "it, it recovers by itself and may be met again. Of the target alone, whose model is "
            "linear; identification always takes contact for bilateral. By default bilateral.",
            choices=("bilateral", "unilateral"),
        ),
    ] = None
    assumed_gripper: Annotated[
        Mapping[str, Any] | str | None,
        Key(
            "The gripper that the identification believes in, where it differs from the true one: "
            "keys of a gripper block (its angle being the one at contact), or `calibrated` for "
            "what a no-load test of the true one finds."
        ),
    ] = None

    @property
    def recorded(self) -> bool:
        """Whether its trace was recorded, not simulated."""
        return self.measurement.file is not None

    @property
    def known(self) -> Mapping[str, float]:
        """Parameters that are not identified."""
        return self.fixed or {}

    @property
    def _searched(self) -> list[Parameter]:
        return [p for p in self.sample.sample.model.parameters if p.name not in self.known]

    @property
    def _genes(self) -> int:
        return sum(getattr(self.search_range, p.range_name).digits + 1 for p in self._searched)

    def problems(self) -> Iterator[Problem]:
        """Find blocks that do not go together."""
        if self.recorded:
            for name in self.sample.parameters:
                text = "is what a recorded trace is to tell; leave it out."
                yield ("sample", name), text
        else:
            for path, text in self.sample.missing():
                yield ("sample", *path), text
        yield from self._fixed_problems()
        yield from self._contact_problems()
        yield from self.of_methods.problems_of(self._genes)
        if not self.recorded:
            yield from self._sampling_problems()
        if isinstance(self.assumed_gripper, str):
            if self.assumed_gripper == CALIBRATED:
                yield from self._calibration_problems()
            else:
                text = f"found '{self.assumed_gripper}', allowed is '{CALIBRATED}' or keys of a "
                yield ("assumed_gripper",), f"{text}gripper block."

    def contact_problems(self, comb: CombDrive) -> Iterator[Problem]:
        """Find a sample that the jaws cannot be closed onto."""
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

    def _fixed_problems(self) -> Iterator[Problem]:
        model = self.sample.sample.model
        for name in self.known:
            if name not in model.names:
                text = f"is no parameter of the sample, which has {', '.join(model.names)}."
                yield ("fixed", name), text + nearest(name, model.names)
        for path, text in _value_problems(model, self.known):
            yield ("fixed", *path), text
        if set(model.names) <= set(self.known):
            yield ("fixed",), "leaves nothing to identify; allowed are fewer parameters."

    def _sampling_problems(self) -> Iterator[Problem]:
        measured, end = self.measurement, self.protocol.end_s
        needed = len(self._searched) + measured.offset + measured.drift + 1
        times = measured.times_s
        if not times:
            samples = end * measured.rate_Hz + 1
            if not needed <= samples <= _MOST_SAMPLES:
                text = f"found {measured.rate_Hz}, which gives {samples:.6g} samples over the "
                allowed = f"protocol; allowed are {needed} to {_MOST_SAMPLES}."
                yield ("measurement", "rate_Hz"), text + allowed
            return
        if len(times) < needed:
            text = f"found {len(times)} times, allowed are at least {needed}."
            yield ("measurement", "times_s"), text
        for index, (before, after) in enumerate(pairwise(times), start=1):
            if not before < after <= end:
                text = f"found {after}, allowed is later than {before} and at most {end} s."
                yield ("measurement", "times_s", index), text
                break

    def _calibration_problems(self) -> Iterator[Problem]:
        """A free arm must be seen ringing: sampled fast enough, for long enough."""
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


OVERRIDABLE = (
    *(field.name for field in fields(Shared) if field.name != "of_methods"),
    *dict.fromkeys(name for method in METHODS.values() for name in method.blocks),
)
"""Blocks that hold for all cases, and that a case may change for itself."""
