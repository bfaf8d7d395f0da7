"""Config blocks of a study, of its cases, and of sweeps, and conflicts between them.

A case has all blocks of the study, merged with its own. Beside the bounds of single keys, its
blocks must fit each other: protocol and readings to the instrument, true values to what is
searched, sampling to the protocol.

A sweep is a grid of cases that differ from a case of the study in two values. A point of it is a
case of its own. Its name is made of its values, so that the random streams, which derive from it,
stay the same when values are added.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, Field, Tag

from biogrip.config.design_blocks import MOST_CASES, CasesBlocks
from biogrip.config.loading import checked
from biogrip.config.source import overlaid
from biogrip.config.trace_blocks import (
    CandidateName,
    CaseName,
    ExperimentBlocks,
    IntervalBlock,
    SampleBlocks,
)
from biogrip.digits import counted
from biogrip.errors import nearest
from biogrip.fit.problem import GeneRange
from biogrip.keys import (
    BY_KIND,
    OPEN,
    Block,
    Complaint,
    Distinct,
    OneOf,
    Printed,
    below,
    formed,
    plain,
    unknown_names,
)
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.gripper import Gripper
from biogrip.physics.models import CANDIDATES
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
_ERROR = "a number of at most 12 characters, with < or > before it where the paper has it"
_PrintedError = Annotated[str, formed(r"^[<>]?[+-]?[0-9]{1,6}(\.[0-9]{1,3})?$", _ERROR)]


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


def _of_methods() -> Iterator[tuple[str, Any, Any]]:
    """Yield key, kind and default of the blocks of methods; one that needs a key has no default."""
    for method in METHODS.values():
        kind: Any = method.settings
        needs = any(key.default is key.default_factory is MISSING for key in fields(kind))
        yield method.key, kind, field() if needs else field(default_factory=kind)


if TYPE_CHECKING:

    class _MethodBlocks(Block): ...
else:
    _MethodBlocks = make_dataclass(
        "_MethodBlocks", _of_methods(), bases=(Block,), frozen=True, kw_only=True
    )


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


MOST_POINTS = 2000

_Method = Annotated[str, OneOf(METHODS)]
_Number = Annotated[float, Field(ge=-1e12, le=1e12), Tag("a number")]
_Text = Annotated[str, Field(max_length=60), Tag("text")]


class ValueBlock(BaseModel):
    """Keys to merge into the block that the axis' key names."""

    model_config = OPEN
    __pydantic_extra__: dict[str, Annotated[_Number | _Text, BY_KIND]] = Field(init=False)

    label: Printed
    """Name of the value in print."""


_Keys = Distinct[Annotated[tuple[str, ...], Field(min_length=1, max_length=100)]]
_AxisValue = Annotated[_Number | _Text | Annotated[ValueBlock, Tag("a block of keys")], BY_KIND]


@dataclass(frozen=True)
class Value:
    """A value on an axis of a sweep's grid."""

    name: str
    """Text for case names."""
    shown: str
    """Text for the axis and its table; numbers in the axis' unit."""
    overrides: dict[str, float | str]
    """Values that replace those of the case, by dotted key."""


@dataclass(frozen=True)
class AxisBlock(Block):
    """One axis of a sweep's grid: a key, or several, and its values."""

    label: Printed
    """Name in print."""
    key: Annotated[Annotated[str, Tag("text")] | Annotated[_Keys, Tag("a list")], BY_KIND]
    """Dotted key, or list of keys that change together, in any block that a case may change, e.g.
    `measurement.noise.level`."""
    values: Distinct[Annotated[tuple[_AxisValue, ...], Field(min_length=1, max_length=16)]]
    """Values of the key; or blocks to merge into the block of the key, each with a `label` of its
    own."""
    unit: Printed | None = None
    """Unit in print."""
    unit_in_si: Annotated[float, Field(ge=1e-24, le=1e24)] = 1.0
    """Size of this unit in the unit of the key, by default 1."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys that change together."""
        return (self.key,) if isinstance(self.key, str) else self.key

    @property
    def title(self) -> str:
        """Label with the unit."""
        return self.label if self.unit is None else f"{self.label} ({self.unit})"

    @property
    def levels(self) -> tuple[Value, ...]:
        """Values with their texts, in the order of the config."""
        return tuple(map(self._level, self.values))

    def _level(self, value: float | str | ValueBlock) -> Value:
        if isinstance(value, ValueBlock):
            inner = dict(sorted((value.model_extra or {}).items()))
            overrides = {f"{key}.{name}": inner[name] for key in self.keys for name in inner}
            return Value("-".join(map(_word, inner.values())), value.label, overrides)
        shown = value if isinstance(value, str) else f"{value / self.unit_in_si:.4g}"
        return Value(_word(value), shown, dict.fromkeys(self.keys, value))

    def complaints(self) -> Iterator[Complaint]:
        """Refuse values of one name, and keys that no case may change."""
        for key in self.keys:
            if key.partition(".")[0] not in OVERRIDABLE:
                text = f"found '{key}', allowed is a key in a block that a case may change."
                yield ("key",), text + nearest(key, OVERRIDABLE)
        shown = [value.shown for value in self.levels]
        for index, value in enumerate(shown):
            if value in shown[:index]:
                yield ("values", index), f"is called '{value}' like one before it."


@dataclass(frozen=True)
class Point:
    """A point of a sweep's grid, i.e. a case with two values changed."""

    name: str
    """Name of the point's case."""
    case: str
    """Case that the point's case is derived from."""
    row: Value
    """Value on the axis of the rows."""
    column: Value
    """Value on the axis of the columns."""


@dataclass(frozen=True)
class SweepBlock(Block):
    """A grid of cases that differ from given cases in two values."""

    cases: Distinct[Annotated[tuple[str, ...], Field(min_length=1, max_length=16)]]
    """Cases of the study that the grid is laid over."""
    rows: AxisBlock
    columns: AxisBlock
    title: Printed | None = None
    """Name in print; by default the sweep's name."""

    def points(self, name: str, case: str) -> list[Point]:
        """Return the points of one case, row by row, of the sweep of a name."""
        return [
            Point(f"{case}--{name}--{row.name}--{column.name}", case, row, column)
            for row, column in product(self.rows.levels, self.columns.levels)
        ]

    def complaints(self) -> Iterator[Complaint]:
        """Refuse keys that both axes set."""
        ours = {key for value in self.rows.levels for key in value.overrides}
        for index, changing in enumerate(self.columns.levels):
            for key in sorted(ours & changing.overrides.keys()):
                yield ("columns", "values", index), f"sets {key}, which the rows do too."

    def placed(self, point: Point, complaint: Complaint) -> Complaint:
        """Return a complaint of a point's case as one of the value that causes it."""
        path, text = complaint
        key = ".".join(map(str, path))
        for axis, value in (("rows", point.row), ("columns", point.column)):
            if any(f"{key}.".startswith(f"{changed}.") for changed in value.overrides):
                index = getattr(self, axis).levels.index(value)
                return (axis, "values", index), f"gives {key}: {text}"
        return (), f"{point.name}: gives {key}: {text}"


def list_points(sweeps: Mapping[str, SweepBlock]) -> Iterator[tuple[str, Point]]:
    """Yield every point of all sweeps with its sweep's name."""
    for name, sweep in sweeps.items():
        for case in sweep.cases:
            for point in sweep.points(name, case):
                yield name, point


def point_blocks(
    sweeps: Mapping[str, SweepBlock], cases: Mapping[str, CaseBlock]
) -> dict[str, dict[str, Any]]:
    """Return the config block of every point's case by name, as plain data, for checked sweeps."""
    by_name = {}
    blocks = {name: plain(case) for name, case in cases.items()} if sweeps else {}
    for _, point in list_points(sweeps):
        by_name[point.name] = blocks[point.case]
        for key, value in (point.row.overrides | point.column.overrides).items():
            # A key that counts takes no 8.0.
            changed: Any = int(value) if isinstance(value, float) and value.is_integer() else value
            for name in reversed(key.split(".")):
                changed = {name: changed}
            by_name[point.name] = overlaid(by_name[point.name], changed)
    return by_name


def _word(value: float | str) -> str:
    text = value if isinstance(value, str) else f"{value:.15g}"
    return re.sub(r"[^A-Za-z0-9-]+", "_", text)


_SWEEP = "a letter, then up to 31 letters, digits or '_'"
_SweepName = Annotated[str, formed("^[A-Za-z][A-Za-z0-9_]{0,31}$", _SWEEP)]


@dataclass(frozen=True)
class Evaluation(Block):
    """Criteria by which identifications count as successful."""

    optimum_tolerance: Annotated[float, Field(gt=0, le=100)]
    """A run reaches the best encodable point of its trace if its χ² exceeds that of the point by at
    most this. A change of one parameter by its standard deviation raises χ² by one."""
    near_noise_tolerance: Annotated[float, Field(ge=0, le=1)]
    """A seed counts as near the noise if its misfit exceeds the RMS of the noise in its trace by at
    most this share. With thousands of samples that is a large increase of χ², so the fit need not
    be an optimum."""


@dataclass(frozen=True)
class ReadingBlock(Block):
    """An interpretation of what the paper leaves open: changes to every simulated case."""

    title: Printed
    """Name in print."""
    changes: Mapping[str, Any]
    """Merged into each case, with keys of a case, e.g. `genetic_algorithm: {patience: 60}`."""
    runs: Annotated[int, Field(ge=1, le=100)] = 1
    """Number of runs on a trace, the best of which is shown."""
    polished: bool = False
    """A local fit follows the algorithm."""


@dataclass(frozen=True)
class TracesBlock(Block):
    """A table of recorded traces, which are identified in batches of rows."""

    table: Annotated[str, Field(min_length=1, max_length=4000)]
    """The table, a row a trace; relative to where Snakemake runs."""
    config: Annotated[str | None, Field(min_length=1, max_length=4000)] = None
    """Config of the traces, as `biogrip identify --config` takes it: gripper, protocol, ... By
    default that of every trace."""
    model: CandidateName = "generalized_maxwell"
    """Sample model of all traces; a column `sample.model` goes before it."""
    rows_a_batch: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of rows per job. Changes no result."""


@dataclass(frozen=True, kw_only=True)
class StudyConfig(CasesBlocks, Shared):
    """All keys of a study's config."""

    seeds: Annotated[int, Field(ge=1, le=1_000_000)]
    """Number of noisy traces of each case that are made and identified. Raising it keeps the
    batches that are full."""
    batch_size: Annotated[int, Field(ge=1, le=100_000)] = 500
    """Number of seeds per job, by default 500. Changes no result, only how much of a job is
    start-up."""
    pdf: bool = False
    """Whether figures are also written as PDF. Changes no result."""
    methods: Distinct[Annotated[tuple[_Method, ...], Field(min_length=1, max_length=100)]]
    """Identification methods applied to every trace. Tables 5-7 and figures of single fits show the
    first."""
    evaluation: Evaluation
    reconstructed: Annotated[tuple[str, ...], Field(max_length=1000)]
    """Keys, or whole blocks, whose values the paper does not give. Tables mark them."""
    cases: Annotated[Mapping[CaseName, CaseBlock], Field(min_length=1, max_length=MOST_CASES)]
    """The samples of the study, by name, at most 2000. Any block that a study sets for all cases,
    as gripper, protocol or measurement, may be given in a case, too; its keys then hold for this
    case alone."""
    traces: TracesBlock | None = None
    """A table of recorded traces, which are identified in batches beside the cases, as `biogrip
    identify` does."""
    sweeps: Mapping[_SweepName, SweepBlock] = field(default_factory=dict)
    """Grids of cases, by name, of at most 2000 points together. Every point is a case that differs
    in two values; it is identified like others, and shown in the sweep's table only."""
    readings: Annotated[Mapping[_SweepName, ReadingBlock], Field(max_length=100)] = field(
        default_factory=dict
    )
    """Interpretations of the paper's text, by name, each tried with the genetic algorithm on the
    noisy traces of every simulated case, for a table."""

    def complaints(self) -> Iterator[Complaint]:
        """Find too many jobs, samples that do not fit, and names of nothing that there is."""
        yield from super().complaints()
        yield from self._model_complaints()
        chosen = [name for name in self.cases if name in (self.only or self.cases)]
        yield from self._point_complaints(chosen)
        for title, sweep in self.sweeps.items():
            yield from unknown_names(("sweeps", title, "cases"), sweep.cases, chosen)

    def _model_complaints(self) -> Iterator[Complaint]:
        """Find models that are only valid for shorter protocols."""
        simulated = (case for case in self.cases.values() if not case.recorded)
        longest = max((case.protocol.end_s for case in simulated), default=0.0)
        for index, name in enumerate(self.model_selection.models):
            if CANDIDATES[name].model.power_law and longest > LONGEST_S:
                text = f"found {name} and a protocol of {longest:g} s, allowed are at most"
                yield ("model_selection", "models", index), f"{text} {LONGEST_S:g} s with it."

    def _point_complaints(self, cases: Iterable[str]) -> Iterator[Complaint]:
        """Find too many points of sweeps, and such as have the name of another or of a case."""
        points, taken = [*list_points(self.sweeps)], {*cases}
        if len(points) > MOST_POINTS:
            yield ("sweeps",), f"found {len(points)} points, allowed are {MOST_POINTS} together."
        for sweep, point in points:
            if point.name in taken:
                text = f"has the point {point.name}, a name that there is already"
                yield ("sweeps", sweep), f"{text}; allowed is another."
            taken.add(point.name)
