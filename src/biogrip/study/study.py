"""Typed access to a checked config: the study and its cases."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

from biogrip.design.settings import DesignSettings
from biogrip.experiment.noise import Noise
from biogrip.experiment.protocol import Phase, torque_history
from biogrip.experiment.sample import CANDIDATES, Sample, SampleModel, with_fixed
from biogrip.experiment.sampling import Sampling
from biogrip.experiment.truth import UNPUBLISHED, Published, Truth
from biogrip.identifiability.posterior_settings import PosteriorSettings
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.genome import GeneRange
from biogrip.identify.methods import METHODS, Method
from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.calibration import CalibrationTest
from biogrip.instrument.gripper import Gripper
from biogrip.study.case_blocks import CALIBRATED, CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.interpretations import read_blocks
from biogrip.study.plain import built, plain
from biogrip.study.source import overlaid
from biogrip.study.sweeps import SweepBlock, point_blocks
from biogrip.traces.recordings import Columns

if TYPE_CHECKING:
    from biogrip.identify.least_squares import LeastSquaresSettings


@dataclass(frozen=True)
class Case:
    """A case of the study: one sample with its experiment and identification."""

    name: str
    """Name used in files."""
    block: CaseBlock
    """Config block, with the study's blocks merged in."""
    study: "Study"

    @property
    def title(self) -> str:
        """Title in tables and figures."""
        return self.name if self.block.title is None else self.block.title

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.block.recorded

    @property
    def seeds(self) -> int:
        """Number of traces; 1 for a recorded trace."""
        return 1 if self.recorded else self.study.config.seeds

    @property
    def actuator(self) -> CombDrive:
        """Comb drive of the study."""
        return self.study.actuator

    @cached_property
    def sample(self) -> Sample:
        """Constitutive model."""
        return self.block.sample.sample

    @property
    def parameters(self) -> dict[str, float]:
        """True parameters by name, SI units, branches by relaxation time; none if recorded."""
        given = self.block.sample.parameters
        known = {name: float(given[name]) for name in self.sample.model.names if name in given}
        searched = with_fixed(self.sample.model, self.fixed)
        whole = len(known) == len(self.sample.model.names)
        return searched.named_in_order(known) if whole else known

    @property
    def size_m(self) -> float | None:
        """Diameter of the sample, if it is given."""
        return self.block.sample.size_m

    @property
    def fixed(self) -> dict[str, float]:
        """Parameters that are not identified, by name."""
        return {name: float(value) for name, value in self.block.known.items()}

    @property
    def published(self) -> Published:
        """Results that the paper reports for the sample."""
        return self.block.published or UNPUBLISHED

    @property
    def truth(self) -> Truth:
        """True values of the sample, with the paper's results."""
        return Truth(self.title, self.sample, self.parameters, self.published)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of the protocol, in torques."""
        return self.block.protocol.torques(self.actuator)

    @cached_property
    def gripper(self) -> Gripper:
        """True gripper, at the angle at which the jaws touch the sample."""
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
    def experiment(self) -> tuple[tuple[Phase, ...], Sampling]:
        """Protocol and sampling."""
        return self.phases, self.sampling

    @property
    def searched(self) -> SampleModel:
        """Sample model without fixed parameters."""
        return self.problem.searched

    @property
    def design(self) -> DesignSettings:
        """Inputs of designs for a case that has them."""
        assert self.block.design is not None
        return self.block.design

    @property
    def noise(self) -> Noise:
        """Noise to add to the simulated rotation."""
        return self.block.measurement.noise

    @property
    def sampling(self) -> Sampling:
        """Sampling of the rotation."""
        return self.block.measurement.sampling

    @property
    def samples(self) -> int:
        """Number of samples in a simulated trace."""
        return len(self.sampling.over(torque_history(self.phases).end_s))

    @property
    def nonlinear_target(self) -> bool:
        """True if the target is simulated with the nonlinear equations."""
        return self.block.models.target == "nonlinear"

    @property
    def unilateral(self) -> bool:
        """True if the target's jaws cannot pull: contact is lost where the force turns tensile."""
        return self.block.contact == "unilateral"

    @property
    def file(self) -> str:
        """Path of the recorded trace; empty for a simulated case."""
        return self.block.measurement.file or ""

    @property
    def columns(self) -> Columns:
        """Columns of a recorded trace's file."""
        return self.block.measurement.columns

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Search ranges by name."""
        return dict(vars(self.block.search_range))

    @property
    def is_calibrated(self) -> bool:
        """True if identification takes the gripper's arms from a calibration."""
        return self.block.assumed_gripper == CALIBRATED

    @property
    def calibration(self) -> CalibrationTest:
        """Settings of the calibration test without sample."""
        return self.block.calibration

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
            nonlinear=self.block.models.identification == "nonlinear",
            offset=measurement.fits_offset,
            drift=measurement.fits_drift,
            noise_rad=measurement.noise_rad,
            noise_share=measurement.noise_share,
            coloured=measurement.coloured,
            uncertainty=self.block.gripper.uncertainties(self.actuator),
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
        return {name: cases[self.name] for name, cases in self.study.interpretations.items()}

    @property
    def models(self) -> dict[str, Sample]:
        """Sample models to fit to the case's traces by name, see `CANDIDATES`."""
        names = (*self.study.config.model_selection.models, self.sample.candidate)
        return {name: CANDIDATES[name] for name in names}

    @property
    def confidence(self) -> float:
        """Confidence level of all intervals."""
        return self.block.identifiability.confidence

    @property
    def posterior(self) -> PosteriorSettings | None:
        """Settings of posterior sampling, if the posterior is sampled."""
        return self.block.posterior

    @property
    def compared_models(self) -> dict[str, Sample]:
        """Sample models whose evidence is compared, by name; none if it is not asked for."""
        compared = self.posterior and self.posterior.evidence and not self.fixed
        return self.models if compared else {}

    @property
    def coverage_seeds(self) -> int:
        """Number of seeds to test the coverage of intervals with; 0 without noise."""
        tried = not self.recorded and not self.noise.absent
        return self.block.identifiability.coverage_seeds if tried else 0

    @property
    def verdicts_every(self) -> int:
        """Seeds of the coverage test that are multiples of this get verdicts, too."""
        return self.block.identifiability.verdicts_every

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

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Cases by name, in the order of the config."""
        return self._cases(self.config.cases)

    @cached_property
    def points(self) -> dict[str, Case]:
        """Cases of all points of the sweeps, by name."""
        blocks = point_blocks(self.sweeps, self.config.cases)
        return self._cases({name: built(CaseBlock, block) for name, block in blocks.items()})

    @property
    def sweeps(self) -> Mapping[str, SweepBlock]:
        """Sweeps by name."""
        return self.config.sweeps

    @cached_property
    def interpretations(self) -> dict[str, dict[str, Case]]:
        """Simulated cases under each interpretation, by name of interpretation and case."""
        found: dict[str, dict[str, Case]] = {name: {} for name in self.config.interpretations}
        for interpretation, name, block in read_blocks(
            self.config.interpretations, self.config.cases
        ):
            found[interpretation] |= self._cases({name: built(CaseBlock, block)})
        return found

    def _cases(self, blocks: Mapping[str, CaseBlock]) -> dict[str, Case]:
        return {name: Case(name, block, self) for name, block in blocks.items()}

    def case(self, name: str) -> Case:
        """Return a case of the study or of a sweep's point."""
        return self.cases[name] if name in self.cases else self.points[name]

    @property
    def study_seed(self) -> int:
        """Seed from which all random streams are derived."""
        return self.config.study_seed

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
    def selects_models(self) -> bool:
        """True if every trace is fitted with several sample models."""
        return bool(self.config.model_selection.models)

    @property
    def batch_size(self) -> int | None:
        """Number of seeds per job, if the config sets it."""
        return self.config.batch_size

    @property
    def near_noise_tolerance(self) -> float:
        """Share by which the misfit may exceed the noise, to count as near the noise."""
        return self.config.evaluation.near_noise_tolerance

    @property
    def optimum_tolerance(self) -> float:
        """Increase of chi^2 over the lowest known that still counts as the global optimum."""
        return self.config.evaluation.optimum_tolerance

    @property
    def gripper(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return self.config.gripper.neutral

    @property
    def jaw_gap_m(self) -> float:
        """Distance between the jaws in the neutral configuration."""
        return self.config.gripper.jaw_gap_m

    @property
    def actuator(self) -> CombDrive:
        """The comb drive of both arms."""
        return self.config.actuator

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Protocol of all cases if it is the same, else of the study."""
        own = {case.phases for case in self.cases.values()}
        return own.pop() if len(own) == 1 else self.config.protocol.torques(self.config.actuator)

    @property
    def experiment(self) -> tuple[tuple[Phase, ...], Sampling]:
        """Protocol and sampling, for cases that do not change them."""
        phases = self.config.protocol.torques(self.config.actuator)
        return phases, self.config.measurement.sampling

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Search ranges of the study, for cases that do not change them."""
        return dict(vars(self.config.search_range))

    @property
    def reconstructed(self) -> tuple[str, ...]:
        """Dotted keys, or whole blocks, whose values the paper omits."""
        return self.config.reconstructed

    def is_reconstructed(self, key: str) -> bool:
        """Return whether a dotted key is marked as reconstructed, i.e. omitted in the paper."""
        return any(key == name or key.startswith(f"{name}.") for name in self.reconstructed)

    @property
    def simulated(self) -> list[str]:
        """Names of cases that are simulated."""
        return [name for name, case in self.cases.items() if not case.recorded]

    @property
    def recorded(self) -> list[str]:
        """Names of cases with a recorded trace."""
        return [name for name, case in self.cases.items() if case.recorded]

    @property
    def covered(self) -> list[str]:
        """Names of cases whose intervals are tested for coverage."""
        return [name for name, case in self.cases.items() if case.coverage_seeds > 0]

    @property
    def sampled(self) -> list[str]:
        """Names of cases whose posterior is sampled."""
        return [name for name, case in self.cases.items() if case.posterior is not None]

    @property
    def published(self) -> list[str]:
        """Names of cases that the paper reports results of."""
        return [name for name, case in self.cases.items() if case.published.table is not None]
