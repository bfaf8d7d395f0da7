"""A checked config as the study and its cases, with what other modules need of them."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from biogrip.fit.experiment import Experiment
from biogrip.fit.genetic import GeneticSettings
from biogrip.fit.genome import GeneRange, SearchRange
from biogrip.fit.methods import METHODS, Method
from biogrip.keys import built, plain
from biogrip.physics.contact import Contact
from biogrip.physics.gripper import NO_ARMS, Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import CANDIDATES, UNPUBLISHED, Sample
from biogrip.physics.protocol import Phase, torque_history
from biogrip.physics.sample_model import with_fixed
from biogrip.study.case_blocks import CALIBRATED, CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.source import default_config, overlaid, read_config
from biogrip.study.sweeps import point_blocks

if TYPE_CHECKING:
    from biogrip.fit.least_squares import LeastSquaresSettings

_Part = TypeVar("_Part")


# Attributes, with the type of what the function returns.
def _of_case(part: Callable[["Case"], _Part]) -> cached_property[_Part]:
    return cached_property(part)


def _of_study(part: Callable[["Study"], _Part]) -> cached_property[_Part]:
    return cached_property(part)


@dataclass(frozen=True)
class Case:
    """A case of the study: one sample with its experiment and identification."""

    name: str
    """Name used in files."""
    block: CaseBlock
    """Config block, with the study's blocks merged in."""
    study: "Study"

    # What other modules need of the blocks, by the names that it has there.
    recorded = _of_case(lambda case: case.block.recorded)
    actuator = _of_case(lambda case: case.study.config.actuator)
    instrument = _of_case(lambda case: case.block.instrument_used)
    size_m = _of_case(lambda case: case.block.sample.size_m)
    published = _of_case(lambda case: case.block.published or UNPUBLISHED)
    noise = _of_case(lambda case: case.block.measurement.noise)
    sampling = _of_case(lambda case: case.block.measurement.sampling)
    nonlinear_target = _of_case(lambda case: case.block.models.target == "nonlinear")
    unilateral = _of_case(lambda case: case.block.contact == "unilateral")
    file = _of_case(lambda case: case.block.measurement.file or "")
    columns = _of_case(lambda case: case.block.measurement.columns)
    is_calibrated = _of_case(lambda case: case.block.assumed_gripper == CALIBRATED)
    calibration = _of_case(lambda case: case.block.calibration)
    confidence = _of_case(lambda case: case.block.identifiability.confidence)
    verdicts_every = _of_case(lambda case: case.block.identifiability.verdicts_every)
    ranges = _of_case(lambda case: dict[str, GeneRange](vars(case.block.search_range)))
    title = _of_case(lambda case: case.block.title or case.name)
    method = _of_case(lambda case: case.block.method)
    sample = _of_case(lambda c: replace(c.block.sample.sample, per_area=c.instrument.per_area))
    """Constitutive model."""
    phases = _of_case(lambda case: case.block.protocol.make_phases(case.instrument, case.actuator))
    """Phases of the protocol, in torques or what else the instrument holds."""
    plain = _of_case(lambda case: cast("dict[str, Any]", plain(case.block)))
    """Config block as plain values, without keys that have their default."""
    seeds = _of_case(lambda case: 1 if case.recorded else case.study.config.seeds)
    """Number of traces; 1 for a recorded trace."""
    fixed = _of_case(lambda case: {name: float(it) for name, it in case.block.fixed.items()})
    """Parameters that are not identified, by name."""
    searched = _of_case(lambda case: case.experiment.searched)
    """Sample model without fixed parameters."""
    torque = _of_case(lambda it: torque_history(it.phases, deforms=it.instrument.deforms))
    """What the instrument holds over time."""
    network = _of_case(lambda case: case.sample.model.sample(case.parameters))
    """Springs and dampers of the simulated sample."""
    samples = _of_case(lambda case: len(case.sampling.over(case.torque.end_s)))
    """Number of samples in a simulated trace."""
    methods = _of_case(lambda case: {it: case.method(it) for it in case.study.config.methods})
    """Settings of the study's identification methods by name."""
    least_squares = _of_case(lambda it: cast("LeastSquaresSettings", it.method("least_squares")))
    """Settings of the least-squares fits that judgements are based on."""
    genetic = _of_case(lambda case: cast("GeneticSettings", case.method("genetic")))
    """Settings of the genetic algorithm."""

    @property
    def may_start_late(self) -> bool:
        """True if the trace is recorded, and nothing says when its protocol starts."""
        measured = self.block.measurement
        return self.recorded and measured.start_s is None and not measured.fit_start

    @property
    def parameters(self) -> dict[str, float]:
        """True parameters by name, SI units, branches by relaxation time; none if recorded."""
        given, model = self.block.sample.parameters, self.sample.model
        known = {name: float(given[name]) for name in model.names if name in given}
        whole = len(known) == len(model.names)
        return with_fixed(model, self.fixed).named_in_order(known) if whole else known

    @cached_property
    def _contact(self) -> Contact | None:
        """State of the gripper when it is closed onto the sample, if its size is known."""
        size_m = self.size_m
        return None if size_m is None else self.block.gripper.contact(self.actuator, size_m)

    @cached_property
    def gripper(self) -> Gripper:
        """True gripper, at the angle at which the jaws touch the sample; or none."""
        if not self.instrument.has_jaws:
            return NO_ARMS
        neutral, at = self.block.gripper.neutral, self._contact
        return replace(neutral, reference_angle_deg=at.reference_angle_deg) if at else neutral

    @property
    def stroke(self) -> float:
        """Rotation left for gripping: the comb drive's stroke minus closing onto the sample."""
        closing = self._contact.closing if self._contact else 0.0
        return math.radians(self.actuator.stroke_deg) - closing

    @cached_property
    def experiment(self) -> Experiment:
        """What was done, for any identification; a calibration replaces the gripper's arms."""
        assumed, measurement = self.block.assumed_gripper, self.block.measurement
        gripper = self.gripper
        if isinstance(assumed, Mapping):
            gripper = built(Gripper, overlaid(plain(gripper), assumed))
        uncertainty = self.block.gripper.uncertainty if self.instrument.has_jaws else None
        return Experiment(
            gripper,
            self.phases,
            self.ranges,
            self.sample,
            self.fixed,
            self.instrument,
            offset=measurement.fits_offset,
            drift=measurement.fits_drift,
            noise_sd=measurement.noise_rad,
            noise_share=measurement.noise_share,
            coloured=measurement.coloured,
            uncertainty=uncertainty.by_part if uncertainty else {},
            fit_start=measurement.fit_start,
            undeclared=measurement.undeclared,
            given_ranges=self.given_ranges,
            start_given=not self.may_start_late,
            simulated=not self.recorded,
            name=self.name,
        )

    @property
    def given_ranges(self) -> frozenset[str]:
        """Names of search ranges that are not the default study's: those that the user gave."""
        default = built(SearchRange, read_config(default_config())["search_range"])
        return frozenset(
            name for name, genes in self.ranges.items() if genes != getattr(default, name)
        )

    @property
    def judged_experiment(self) -> Experiment:
        """What was done, and how a trace is judged."""
        models: tuple[str, ...] = ()
        if self.recorded:
            models = self.study.config.model_selection.models
        return replace(
            self.experiment,
            models=models,
            cheap_models=[*models] == read_config(default_config())["model_selection"]["models"],
            least_squares=self.least_squares,
            confidence=self.confidence,
            study_seed=self.study.study_seed,
        )

    @property
    def mutation_start(self) -> int | None:
        """First generation in which children mutate; None if the shown method has no mutation."""
        mutates = "genetic_algorithm" in self.study.shown_method.blocks
        return self.genetic.mutation_start if mutates else None

    @property
    def interpretations(self) -> dict[str, "Case"]:
        """The case under each interpretation of the paper, by the interpretation's name."""
        readings = self.study.interpretations.items()
        blocks = {name: overlaid(self.plain, reading.changes) for name, reading in readings}
        return {name: replace(self, block=built(CaseBlock, it)) for name, it in blocks.items()}

    @property
    def models(self) -> dict[str, Sample]:
        """Sample models to fit to the case's traces by name, see `CANDIDATES`."""
        names = (*self.study.config.model_selection.models, self.sample.candidate)
        per_area = self.instrument.per_area
        return {name: replace(CANDIDATES[name], per_area=per_area) for name in names}

    @property
    def coverage_seeds(self) -> int:
        """Number of seeds to test the coverage of intervals with; 0 without noise."""
        tried = not self.recorded and not self.noise.absent
        return self.block.identifiability.coverage_seeds if tried else 0

    @property
    def has_valley(self) -> bool:
        """True if two exchangeable parameters are searched, and others besides."""
        model = self.sample.model
        pair = [name for name in model.exchangeable if name not in self.fixed]
        return len(pair) == 2 and len(model.names) - len(self.fixed) > 2


@dataclass(frozen=True)
class Study:
    """A study whose config has been checked."""

    config: StudyConfig
    """The whole config, with the study's blocks merged into every case."""
    only: tuple[str, ...] | None = None
    """Names of its cases; by default those of the config."""

    sweeps = _of_study(lambda study: study.config.sweeps)
    study_seed = _of_study(lambda study: study.config.study_seed)
    near_noise_tolerance = _of_study(lambda study: study.config.evaluation.near_noise_tolerance)
    optimum_tolerance = _of_study(lambda study: study.config.evaluation.optimum_tolerance)
    gripper = _of_study(lambda study: study.config.gripper.neutral)
    traces = _of_study(lambda study: study.config.traces)
    jaw_gap_m = _of_study(lambda study: study.config.gripper.jaw_gap_m)
    actuator = _of_study(lambda study: study.config.actuator)
    reconstructed = _of_study(lambda study: study.config.reconstructed)
    methods = _of_study(lambda study: list(study.config.methods))
    ranges = _of_study(lambda study: dict[str, GeneRange](vars(study.config.search_range)))
    plain = _of_study(lambda study: cast("dict[str, Any]", plain(study.config)))
    """Config as plain values, without keys that have their default."""

    cases = _of_study(lambda study: study._cases(study.config.cases, study.only))
    """Cases by name, in the order of the config."""
    simulated = _of_study(lambda study: study._where(lambda case: not case.recorded))
    """Names of cases that are simulated."""
    recorded = _of_study(lambda study: study._where(lambda case: case.recorded))
    """Names of cases with a recorded trace."""
    gripped = _of_study(lambda it: it._where(lambda c: not c.recorded and c.instrument.has_jaws))
    """Names of simulated cases whose sample the gripper holds."""
    has_gripper = _of_study(lambda study: study._where(lambda it: it.instrument.has_jaws) != [])
    """True if the gripper holds the sample of any case."""
    covered = _of_study(lambda study: study._where(lambda case: case.coverage_seeds > 0))
    """Names of cases whose intervals are tested for coverage."""
    published = _of_study(lambda study: study._where(lambda case: case.published.table is not None))
    """Names of cases that the paper reports results of."""
    identifiers = _of_study(lambda study: {name: METHODS[name] for name in study.methods})
    """Declarations of the methods, by name."""
    interpretations = _of_study(lambda study: study.config.interpretations)
    shown = _of_study(lambda study: study.methods[0])
    """Method that tables and figures of a single method show."""
    shown_method = _of_study(lambda study: METHODS[study.shown])
    """Declaration of the shown method."""

    @cached_property
    def points(self) -> dict[str, Case]:
        """Cases of all points of the sweeps, by name."""
        blocks = point_blocks(self.sweeps, self.config.cases)
        return self._cases({name: built(CaseBlock, block) for name, block in blocks.items()})

    def of(self, names: Iterable[str]) -> "Study":
        """Return the study of some of its cases."""
        return Study(self.config, tuple(names))

    def _cases(
        self, blocks: Mapping[str, CaseBlock], only: Iterable[str] | None = None
    ) -> dict[str, Case]:
        names = blocks if only is None else only
        return {name: Case(name, blocks[name], self) for name in names}

    def case(self, name: str) -> Case:
        """Return a case of the study or of a sweep's point."""
        return self.cases[name] if name in self.cases else self.points[name]

    def _where(self, holds: Callable[[Case], bool]) -> list[str]:
        return [name for name, case in self.cases.items() if holds(case)]

    @property
    def fitting_method(self) -> Method:
        """Least squares if the study has it, else the shown method."""
        return METHODS["least_squares" if "least_squares" in self.methods else self.shown]

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Protocol of all cases if it is the same, else of the study."""
        own = {case.phases for case in self.cases.values()}
        if len(own) == 1:
            return own.pop()
        return self.config.protocol.make_phases(GRIPPER, self.actuator)
