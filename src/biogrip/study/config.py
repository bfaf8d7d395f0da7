"""Top-level keys of a study's config."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, Any

from pydantic import Field

from biogrip.errors import nearest
from biogrip.experiment.sample import CANDIDATES
from biogrip.experiment.springpot import LONGEST_S
from biogrip.fit.methods import METHODS
from biogrip.instrument.actuator import CombDrive
from biogrip.keys import Block, Distinct, OneOf, Problem
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock, Shared
from biogrip.study.design_block import DesignBlock
from biogrip.study.interpretations import InterpretationBlock
from biogrip.study.sweeps import MOST_POINTS, SweepBlock
from biogrip.study.traces_block import TracesBlock

SMALLEST_BATCH, LARGEST_BATCH, USUAL_BATCHES = 500, 1000, 8
"""Least and most seeds of a job, and the number of jobs aimed at in between, by default."""

_MOST_BATCHES = 10_000
_MOST_CASES = 2000
# Most names listed in a message.
_SHOWN = 6
_CaseName = Annotated[
    str,
    Field(
        pattern="^[A-Za-z][A-Za-z0-9_-]{0,63}$",
        json_schema_extra={"form": "a letter, then up to 63 letters, digits, '_' or '-'"},
    ),
]
_Name = Annotated[
    str,
    Field(
        pattern="^[A-Za-z][A-Za-z0-9_]{0,31}$",
        json_schema_extra={"form": "a letter, then up to 31 letters, digits or '_'"},
    ),
]


@dataclass(frozen=True)
class ModelSelection(Block):
    """Selection of the simplest adequate sample model by AIC and BIC."""

    models: Annotated[
        tuple[Annotated[str, OneOf(CANDIDATES)], ...], Field(max_length=100), Distinct()
    ]
    """Sample models fitted to every trace, beside that of its case; with an empty list none are. A
    number counts Maxwell branches."""


@dataclass(frozen=True)
class Evaluation(Block):
    """Criteria by which identifications count as successful."""

    optimum_tolerance: Annotated[float, Field(gt=0, le=100)]
    """A seed reaches the global optimum if its χ² exceeds the lowest known of its trace by at most
    this. A change of one parameter by its standard deviation raises χ² by one."""
    near_noise_tolerance: Annotated[float, Field(ge=0, le=1)]
    """A seed counts as near the noise if its misfit exceeds the RMS of the noise in its trace by at
    most this share. With thousands of samples that is a large increase of χ², so the fit need not
    be an optimum."""


class StudyConfig(Shared):
    """All keys of a study's config."""

    study_seed: Annotated[
        int,
        Field(
            ge=0,
            le=2**64 - 1,
            description="The one seed of the study. Noise and genetic algorithm draw from streams "
            "derived from it, the case's name and the seed's number.",
        ),
    ]
    seeds: Annotated[
        int,
        Field(
            ge=1,
            le=1_000_000,
            description="Number of noisy traces of each case that are made and identified. Raising "
            "it keeps the results there are.",
        ),
    ]
    batch_size: Annotated[
        int | None,
        Field(
            ge=1,
            le=100_000,
            description=f"Number of seeds per job. By default {SMALLEST_BATCH}; for more than "
            f"{USUAL_BATCHES * SMALLEST_BATCH} seeds, 1/{USUAL_BATCHES} of them, for more than "
            f"{USUAL_BATCHES * LARGEST_BATCH}, {LARGEST_BATCH}. Changes no result, only how much "
            "of a job is start-up.",
        ),
    ] = None
    actuator: Annotated[CombDrive, Field(description="The rotary comb drive (Table 2).")]
    methods: Annotated[
        tuple[Annotated[str, OneOf(METHODS)], ...],
        Field(
            min_length=1,
            max_length=100,
            description="Identification methods applied to every trace. Tables 5-7 and figures of "
            "single fits show the first.",
        ),
        Distinct(),
    ]
    model_selection: ModelSelection
    evaluation: Evaluation
    reconstructed: Annotated[
        tuple[str, ...],
        Field(
            max_length=1000,
            description="Keys, or whole blocks, whose values the paper does not give. Tables mark "
            "them.",
        ),
    ]
    cases: Annotated[
        Mapping[_CaseName, CaseBlock],
        Field(
            max_length=_MOST_CASES,
            description=f"The samples of the study, by name, at most {_MOST_CASES}. Any of the "
            f"blocks {', '.join(OVERRIDABLE)} may be given in a case, too; its keys then hold for "
            "this case alone.",
        ),
    ]
    traces: Annotated[
        TracesBlock | None,
        Field(
            description="A table of recorded traces, which are identified in batches beside the "
            "cases, as `biogrip identify` does."
        ),
    ] = None
    only: Annotated[
        tuple[str, ...],
        Field(
            min_length=1,
            max_length=_MOST_CASES,
            description="Names of the cases to run; the others are left out. By default all under "
            "`cases`.",
        ),
        Distinct(),
    ] = ()
    design: DesignBlock = DesignBlock()
    sweeps: Annotated[
        Mapping[_Name, SweepBlock],
        Field(
            description=f"Grids of cases for heat maps, by name, of at most {MOST_POINTS} points "
            "together. Every point is a case that differs in two values; it is identified like "
            "others, and shown in heat maps and their table only."
        ),
    ] = {}
    interpretations: Annotated[
        Mapping[_Name, InterpretationBlock],
        Field(
            max_length=100,
            description="Interpretations of the paper, by name, each tried with the genetic "
            "algorithm on the noisy traces of every simulated case, for a table.",
        ),
    ] = {}

    def problems(self) -> Iterator[Problem]:
        """Find too many jobs, samples that do not fit, and unknown keys marked as reconstructed."""
        if self.batch_size is not None:
            tests = (case.identifiability.coverage_seeds for case in self.cases.values())
            seeds = max(self.seeds, *tests)
            if seeds > _MOST_BATCHES * self.batch_size:
                text = f"found {self.batch_size}, which makes {seeds} seeds more than "
                yield ("batch_size",), f"{text}{_MOST_BATCHES} batches; allowed are larger ones."
        if not self.cases:
            yield ("cases",), "found none, allowed is one or more."
        yield from self._band_problems()
        for name, case in self.cases.items():
            for path, text in case.comb_problems(self.actuator):
                yield ("cases", name, *path), text
        methods = {name: asdict(block) for name, block in self.method_blocks.items()}
        known = self.model_dump() | methods if self.reconstructed else {}
        for index, key in enumerate(self.reconstructed):
            if not _exists(known, key):
                yield ("reconstructed", index), f"found '{key}', allowed is a key of this study."
        yield from self._design_problems()
        for index, name in enumerate(self.only):
            if name not in self.cases:
                text = f"found '{name}', allowed are {', '.join(list(self.cases)[:_SHOWN])}."
                yield ("only", index), text + nearest(name, self.cases)

    def _design_problems(self) -> Iterator[Problem]:
        """Find parameters in the block `design` that no case identifies."""
        found = (p.name for case in self.cases.values() for p in case.searched)
        searched = list(dict.fromkeys(found))
        for index, name in enumerate(self.design.parameters):
            if name not in searched:
                text = f"found '{name}', allowed are {', '.join(searched)}."
                yield ("design", "parameters", index), text + nearest(name, searched)

    def _band_problems(self) -> Iterator[Problem]:
        """Find power-law models in a study whose protocols exceed their range of validity."""
        longest = max((case.protocol.end_s for case in self.cases.values()), default=0.0)
        for index, name in enumerate(self.model_selection.models):
            if not CANDIDATES[name].model.power_law:
                continue
            if longest > LONGEST_S:
                text = f"found {name} and a protocol of {longest:g} s, allowed are at most"
                yield ("model_selection", "models", index), f"{text} {LONGEST_S:g} s with it."

    @property
    def chosen(self) -> "StudyConfig":
        """The study with only the cases that `only` names."""
        cases = {name: self.cases[name] for name in self.only or self.cases}
        return self.model_copy(update={"cases": cases})


def _exists(block: Any, key: str) -> bool:
    for part in key.split("."):
        block = block.get(part) if isinstance(block, Mapping) else None
    return block is not None
