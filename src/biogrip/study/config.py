"""Top-level keys of a study's config, and conflicts between its parts."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field

from biogrip.errors import nearest
from biogrip.fit.problem import METHODS
from biogrip.keys import Block, Complaint, Distinct, OneOf, Printed, adapter, below
from biogrip.physics.fractional import LONGEST_S
from biogrip.physics.gripper import CombDrive
from biogrip.physics.models import CANDIDATES
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock, Shared
from biogrip.study.experiment_blocks import USUAL_NAMES
from biogrip.study.sweeps import MOST_POINTS, SweepBlock, list_points, name_complaints

_MOST_CASES = 2000
# Most names listed in a message.
_SHOWN = 6
_CaseName = Annotated[
    str,
    Field(
        pattern="^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$",
        json_schema_extra={"form": "a letter or digit, then up to 63 of these, '_' or '-'"},
    ),
]
_Name = Annotated[
    str,
    Field(
        pattern="^[A-Za-z][A-Za-z0-9_]{0,31}$",
        json_schema_extra={"form": "a letter, then up to 31 letters, digits or '_'"},
    ),
]
_Candidate = Annotated[str, OneOf(CANDIDATES), USUAL_NAMES]


@dataclass(frozen=True)
class ModelSelection(Block):
    """Selection of the simplest adequate sample model by AIC and BIC."""

    models: Annotated[tuple[_Candidate, ...], Field(max_length=100), Distinct()]
    """Sample models fitted to every trace, beside that of its case; with an empty list none are. A
    number counts Maxwell branches."""


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


@dataclass(frozen=True, kw_only=True)
class DesignBlock(Block):
    """Limits of the trains of steps that `biogrip design` tries, and what they are to tell."""

    steps: Annotated[int, Field(ge=1, le=50)] = 8
    """Number of steps at most. By default 8."""
    largest: Annotated[float | None, Field(ge=1e-50, le=1e12)] = None
    """Largest torque, or what else the protocol holds, in its SI unit. By default the protocol's
    largest."""
    duration_s: Annotated[float | None, Field(ge=1e-6, le=1e9)] = None
    """Duration. By default the protocol's."""
    parameters: Annotated[tuple[str, ...], Field(max_length=40), Distinct()] = ()
    """Parameters asked for; the others are unknown all the same. By default all that are not
    fixed."""


@dataclass(frozen=True)
class TracesBlock(Block):
    """A table of recorded traces, which are identified in batches of rows."""

    table: Annotated[str, Field(min_length=1, max_length=4000)]
    """The table, a row a trace; relative to where Snakemake runs."""
    config: Annotated[str | None, Field(min_length=1, max_length=4000)] = None
    """Config of the traces, as `biogrip identify --config` takes it: gripper, protocol, ... By
    default the default study's."""
    model: _Candidate = "generalized_maxwell"
    """Sample model of all traces; a column `sample.model` goes before it."""
    rows_a_batch: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of rows per job. Changes no result."""


@dataclass(frozen=True, kw_only=True)
class StudyConfig(Shared):
    """All keys of a study's config."""

    study_seed: Annotated[int, Field(ge=0, le=2**64 - 1)]
    """The one seed of the study. Noise and genetic algorithm draw from streams derived from it, the
    case's name and the seed's number."""
    seeds: Annotated[int, Field(ge=1, le=1_000_000)]
    """Number of noisy traces of each case that are made and identified. Raising it keeps the
    batches that are full."""
    batch_size: Annotated[int, Field(ge=1, le=100_000)] = 500
    """Number of seeds per job, by default 500. Changes no result, only how much of a job is
    start-up."""
    pdf: bool = False
    """Whether figures are also written as PDF. Changes no result."""
    actuator: CombDrive
    """The rotary comb drive (Table 2)."""
    methods: Annotated[
        tuple[Annotated[str, OneOf(METHODS)], ...], Field(min_length=1, max_length=100), Distinct()
    ]
    """Identification methods applied to every trace. Tables 5-7 and figures of single fits show the
    first."""
    model_selection: ModelSelection
    evaluation: Evaluation
    reconstructed: Annotated[tuple[str, ...], Field(max_length=1000)]
    """Keys, or whole blocks, whose values the paper does not give. Tables mark them."""
    cases: Annotated[
        Mapping[_CaseName, CaseBlock],
        Field(
            max_length=_MOST_CASES,
            description=f"The samples of the study, by name, at most {_MOST_CASES}. Any of the "
            f"blocks {', '.join(OVERRIDABLE)} may be given in a case, too; its keys then hold for "
            "this case alone.",
        ),
    ]
    traces: TracesBlock | None = None
    """A table of recorded traces, which are identified in batches beside the cases, as `biogrip
    identify` does."""
    only: Annotated[tuple[str, ...], Field(min_length=1, max_length=_MOST_CASES), Distinct()] = ()
    """Names of the cases to run; the others are left out. By default all under `cases`."""
    design: DesignBlock = DesignBlock()
    sweeps: Annotated[
        Mapping[_Name, SweepBlock],
        Field(
            description=f"Grids of cases for heat maps, by name, of at most {MOST_POINTS} points "
            "together. Every point is a case that differs in two values; it is identified like "
            "others, and shown in heat maps and their table only."
        ),
    ] = field(default_factory=dict)
    readings: Annotated[Mapping[_Name, ReadingBlock], Field(max_length=100)] = field(
        default_factory=dict
    )
    """Interpretations of the paper's text, by name, each tried with the genetic algorithm on the
    noisy traces of every simulated case, for a table."""

    def complaints(self) -> Iterator[Complaint]:
        """Find too many jobs, samples that do not fit, and names of nothing that there is."""
        if not self.cases:
            yield ("cases",), "found none, allowed is one or more."
        simulated = (case for case in self.cases.values() if not case.recorded)
        longest = max((case.protocol.end_s for case in simulated), default=0.0)
        for index, name in enumerate(self.model_selection.models):
            if CANDIDATES[name].model.power_law and longest > LONGEST_S:
                text = f"found {name} and a protocol of {longest:g} s, allowed are at most"
                yield ("model_selection", "models", index), f"{text} {LONGEST_S:g} s with it."
        for name, case in self.cases.items():
            yield from below(("cases", name), case.comb_complaints(self.actuator))
        known = adapter(StudyConfig).dump_python([self])[0] if self.reconstructed else {}
        for index, key in enumerate(self.reconstructed):
            block: Any = known
            for part in key.split("."):
                block = block.get(part) if isinstance(block, Mapping) else None
            if block is None:
                yield ("reconstructed", index), f"found '{key}', allowed is a key of this study."
        chosen = [name for name in self.cases if name in (self.only or self.cases)]
        if (points := len([*list_points(self.sweeps)])) > MOST_POINTS:
            yield ("sweeps",), f"found {points} points, allowed are {MOST_POINTS} together."
        yield from below(("sweeps",), name_complaints(self.sweeps, chosen))
        searched = [p.name for case in self.cases.values() for p in case.searched]
        lists: dict[tuple[str, ...], tuple[Iterable[str], Iterable[str]]] = {
            ("design", "parameters"): (self.design.parameters, dict.fromkeys(searched)),
            ("only",): (self.only, self.cases),
            **{("sweeps", name, "cases"): (s.cases, chosen) for name, s in self.sweeps.items()},
        }
        for path, (found, allowed) in lists.items():
            for index, name in enumerate(found):
                if name not in allowed:
                    text = f"found '{name}', allowed are {', '.join([*allowed][:_SHOWN])}."
                    yield (*path, index), text + nearest(name, allowed)
