"""Typed access to a checked config: the study and its cases."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from biogrip.experiment.protocol import Phase, torque_history
from biogrip.experiment.sample import CANDIDATES, Sample, SampleModel, with_fixed
from biogrip.experiment.truth import UNPUBLISHED, Truth
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.genetic_settings import GeneticSettings
from biogrip.fit.genome import GeneRange
from biogrip.fit.methods import METHODS, Method
from biogrip.instrument.gripper import GRIPPER, NO_ARMS, Gripper
from biogrip.study.case_blocks import CALIBRATED, CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.plain import built, plain
from biogrip.study.source import overlaid
from biogrip.study.sweeps import point_blocks

if TYPE_CHECKING:
    from biogrip.fit.least_squares import LeastSquaresSettings

_Part = TypeVar("_Part")


def _of_case(part: Callable[["Case"], _Part]) -> cached_property[_Part]:
    """Make an attribute of a case, with the type of what the function returns."""
    return cached_property(part)


def _of_study(part: Callable[["Study"], _Part]) -> cached_property[_Part]:
    """Make an attribute of a study, with the type of what the function returns."""
    return cached_property(part)


@dataclass(frozen=True)
class Case:
    """A case of the study: one sample with its experiment and identification."""

    name: str
    """Name used in files."""
    block: CaseBlock
    """Config block, with the study's blocks merged in."""
    study: "Study"

    recorded = _of_case(lambda case: case.block.recorded)
    """True if the trace was recorded, not simulated."""
    actuator = _of_case(lambda case: case.study.config.actuator)
    """Comb drive of the study."""
    instrument = _of_case(lambda case: case.block.instrument_used)
    """What is held and read."""
    sample = _of_case(
        lambda case: replace(case.block.sample.sample, per_area=case.instrument.per_area)
    )
    """Constitutive model."""
    size_m = _of_case(lambda case: case.block.sample.size_m)
    """Diameter of the sample, if it is given."""
    published = _of_case(lambda case: case.block.published or UNPUBLISHED)
    """Results that the paper reports for the sample."""
    noise = _of_case(lambda case: case.block.measurement.noise)
    """Noise to add to the simulated rotation."""
    sampling = _of_case(lambda case: case.block.measurement.sampling)
    """Sampling of the rotation."""
    nonlinear_target = _of_case(lambda case: case.block.models.target == "nonlinear")
    """True if the target is simulated with the nonlinear equations."""
    unilateral = _of_case(lambda case: case.block.contact == "unilateral")
    """True if the target's jaws cannot pull: contact is lost where the force turns tensile."""
    file = _of_case(lambda case: case.block.measurement.file or "")
    """Path of the recorded trace; empty for a simulated case."""
    columns = _of_case(lambda case: case.block.measurement.columns)
    """Columns of a recorded trace's file."""
    is_calibrated = _of_case(lambda case: case.block.assumed_gripper == CALIBRATED)
    """True if identification takes the gripper's arms from a calibration."""
    calibration = _of_case(lambda case: case.block.calibration)
    """Settings of the calibration test without sample."""
    confidence = _of_case(lambda case: case.block.identifiability.confidence)
    """Confidence level of all intervals."""
    verdicts_every = _of_case(lambda case: case.block.identifiability.verdicts_every)
    """Seeds of the coverage test that are multiples of this get verdicts, too."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config block as plain values, without keys that have their default."""
        return plain(self.block)

    @property
    def title(self) -> str:
        """Title in tables and figures."""
        return self.name if self.block.title is None else self.block.title

    @property
    def may_start_late(self) -> bool:
        """True if the trace is recorded, and nothing says when its protocol starts."""
        measured = self.block.measurement
        return self.recorded and measured.start_s is None and not measured.fit_start

    @property
    def seeds(self) -> int:
        """Number of traces; 1 for a recorded trace."""
        return 1 if self.recorded else self.study.config.seeds

    @property
    def parameters(self) -> dict[str, float]:
        """True parameters by name, SI units, branches by relaxation time; none if recorded."""
        given = self.block.sample.parameters
        known = {name: float(given[name]) for name in self.sample.model.names if name in given}
        searched = with_fixed(self.sample.model, self.fixed)
        whole = len(known) == len(self.sample.model.names)
        return searched.named_in_order(known) if whole else known

    @property
    def fixed(self) -> dict[str, float]:
        """Parameters that are not identified, by name."""
        return {name: float(value) for name, value in self.block.known.items()}

    @property
    def truth(self) -> Truth:
        """True values of the sample, with the paper's results."""
        return Truth(self.title, self.sample, self.parameters, self.published)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of the protocol, in torques or what else the instrument holds."""
        return self.block.protocol.make_phases(self.instrument, self.actuator)

    @cached_property
    def gripper(self) -> Gripper:
        """True gripper, at the angle at which the jaws touch the sample; or none."""
        if not self.instrument.has_jaws:
            return NO_ARMS
        neutral = self.block.gripper.neutral
        if self.size_m is None:
            return neutral
        touching = self.block.gripper.contact(self.actuator, self.size_m)
        return replace(neutral, reference_angle_deg=touching.reference_angle_deg)

    @property
    def stroke_rad(self) -> float:
        """Rotation left for gripping: the comb drive's stroke minus closing onto the sample."""
        stroke = math.radians(self.actuator.stroke_deg)
        if self.size_m is None:
            return stroke
        return stroke - self.block.gripper.contact(self.actuator, self.size_m).closing_rad

    @property
    def searched(self) -> SampleModel:
        """Sample model without fixed parameters."""
        return self.problem.searched

    @property
    def samples(self) -> int:
        """Number of samples in a simulated trace."""
        return len(self.sampling.over(torque_history(self.phases).end_s))

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Search ranges by name."""
        return dict(vars(self.block.search_range))

    @cached_property
    def problem(self) -> CaseProblem:
        """Assumptions of the identification; a calibration replaces the gripper's arms."""
        assumed, measurement = self.block.assumed_gripper, self.block.measurement
        gripper = self.gripper
        if isinstance(assumed, Mapping):
            gripper = built(Gripper, overlaid(plain(gripper), assumed))
        return CaseProblem(
            gripper,
            self.phases,
            self.ranges,
            self.sample,
            self.fixed,
            self.instrument,
            nonlinear=self.block.models.identification == "nonlinear",
            offset=measurement.fits_offset,
            drift=measurement.fits_drift,
            noise_rad=measurement.noise_rad,
            noise_share=measurement.noise_share,
            coloured=measurement.coloured,
            uncertainty=(
                self.block.gripper.uncertainties(self.actuator) if self.instrument.has_jaws else {}
            ),
            fit_start=measurement.fit_start,
        )

    def method(self, name: str) -> object:
        """Return the settings of an identification method."""
        return self.block.method(name)

    @cached_property
    def methods(self) -> dict[str, object]:
        """Settings of the study's identification methods by name."""
        return {name: self.method(name) for name in self.study.methods}

    @property
    def least_squares(self) -> "LeastSquaresSettings":
        """Settings of the least-squares fits that judgements are based on."""
        return cast("LeastSquaresSettings", self.method("least_squares"))

    @property
    def genetic(self) -> GeneticSettings:
        """Settings of the genetic algorithm."""
        settings = self.block.method_block("genetic_algorithm")
        assert isinstance(settings, GeneticSettings)
        return settings

    @property
    def mutation_start(self) -> int | None:
        """First generation in which children mutate; None if the shown method has no mutation."""
        mutates = "genetic_algorithm" in self.study.shown_method.blocks
        return self.genetic.mutation_start if mutates else None

    @property
    def interpretations(self) -> dict[str, "Case"]:
        """The case under each interpretation of the paper, by the interpretation's name."""
        blocks = self.study.config.interpretations
        return {
            name: replace(self, block=built(CaseBlock, overlaid(self.plain, block.changes)))
            for name, block in blocks.items()
        }

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

    sweeps = _of_study(lambda study: study.config.sweeps)
    """Sweeps by name."""
    study_seed = _of_study(lambda study: study.config.study_seed)
    """Seed from which all random streams are derived."""
    selects_models = _of_study(lambda study: bool(study.config.model_selection.models))
    """True if every trace is fitted with several sample models."""
    batch_size = _of_study(lambda study: study.config.batch_size)
    """Number of seeds per job, if the config sets it."""
    near_noise_tolerance = _of_study(lambda study: study.config.evaluation.near_noise_tolerance)
    """Share by which the misfit may exceed the noise, to count as near the noise."""
    optimum_tolerance = _of_study(lambda study: study.config.evaluation.optimum_tolerance)
    """Increase of chi^2 over the lowest known that still counts as the global optimum."""
    gripper = _of_study(lambda study: study.config.gripper.neutral)
    """The gripper in its neutral configuration."""
    traces = _of_study(lambda study: study.config.traces)
    """Table of recorded traces, if there is one."""
    jaw_gap_m = _of_study(lambda study: study.config.gripper.jaw_gap_m)
    """Distance between the jaws in the neutral configuration."""
    actuator = _of_study(lambda study: study.config.actuator)
    """The comb drive of both arms."""
    reconstructed = _of_study(lambda study: study.config.reconstructed)
    """Dotted keys, or whole blocks, whose values the paper omits."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config as plain values, without keys that have their default."""
        return plain(self.config)

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Cases by name, in the order of the config."""
        return self._cases(self.config.cases)

    @cached_property
    def points(self) -> dict[str, Case]:
        """Cases of all points of the sweeps, by name."""
        blocks = point_blocks(self.sweeps, self.config.cases)
        return self._cases({name: built(CaseBlock, block) for name, block in blocks.items()})

    def of(self, names: Iterable[str]) -> "Study":
        """Return the study of some of its cases."""
        cases = {name: self.config.cases[name] for name in names}
        config = type(self.config).model_construct()
        vars(config).clear()
        vars(config).update({**vars(self.config), "cases": cases})
        object.__setattr__(config, "__pydantic_extra__", self.config.__pydantic_extra__)
        return Study(config)

    def _cases(self, blocks: Mapping[str, CaseBlock]) -> dict[str, Case]:
        return {name: Case(name, block, self) for name, block in blocks.items()}

    def case(self, name: str) -> Case:
        """Return a case of the study or of a sweep's point."""
        return self.cases[name] if name in self.cases else self.points[name]

    @property
    def methods(self) -> list[str]:
        """Identification methods; tables and figures of a single method show the first."""
        return list(self.config.methods)

    @property
    def identifiers(self) -> dict[str, Method]:
        """Declarations of the methods, by name."""
        return {name: METHODS[name] for name in self.methods}

    @property
    def shown(self) -> str:
        """Method that tables and figures of a single method show."""
        return self.methods[0]

    @property
    def shown_method(self) -> Method:
        """Declaration of the shown method."""
        return METHODS[self.shown]

    @property
    def fitting_method(self) -> Method:
        """Least squares if the study has it, else the shown method."""
        return METHODS["least_squares" if "least_squares" in self.methods else self.shown]

    @property
    def interpretation_titles(self) -> dict[str, str]:
        """Titles of the interpretations by name."""
        return {name: block.title for name, block in self.config.interpretations.items()}

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Protocol of all cases if it is the same, else of the study."""
        own = {case.phases for case in self.cases.values()}
        return (
            own.pop() if len(own) == 1 else self.config.protocol.make_phases(GRIPPER, self.actuator)
        )

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Search ranges of the study, for cases that do not change them."""
        return dict(vars(self.config.search_range))

    def is_reconstructed(self, key: str) -> bool:
        """Return True if a dotted key is marked as reconstructed, i.e. omitted in the paper."""
        return any(key == name or key.startswith(f"{name}.") for name in self.reconstructed)

    @property
    def simulated(self) -> list[str]:
        """Names of cases that are simulated."""
        return [name for name, case in self.cases.items() if not case.recorded]

    @property
    def gripped(self) -> list[str]:
        """Names of simulated cases whose sample the gripper holds."""
        return [name for name in self.simulated if self.cases[name].instrument.has_jaws]

    @property
    def has_gripper(self) -> bool:
        """True if the gripper holds the sample of any case."""
        return any(case.instrument.has_jaws for case in self.cases.values())

    @property
    def recorded(self) -> list[str]:
        """Names of cases with a recorded trace."""
        return [name for name, case in self.cases.items() if case.recorded]

    @property
    def covered(self) -> list[str]:
        """Names of cases whose intervals are tested for coverage."""
        return [name for name, case in self.cases.items() if case.coverage_seeds > 0]

    @property
    def published(self) -> list[str]:
        """Names of cases that the paper reports results of."""
        return [name for name, case in self.cases.items() if case.published.table is not None]
