"""The study as its config describes it: cases, and what each of them assumes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from biogrip.experiment.noise import Noise
from biogrip.experiment.protocol import Phase, torque_history
from biogrip.experiment.sample import Sample, with_fixed
from biogrip.experiment.sampling import Sampling
from biogrip.experiment.truth import Published, Truth
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
from biogrip.study.readings import read_blocks
from biogrip.study.source import overlaid
from biogrip.study.sweeps import Sweep, point_blocks, sweeps_of
from biogrip.study.typed import built, plain
from biogrip.traces.recordings import Columns


@dataclass(frozen=True)
class Case:
    """One sample of the study.

    Parameters
    ----------
    name
        Name in files.
    block
        Its config, with the study's blocks filled in.
    actuator
        The study's comb drive.
    study_seeds
        How many seeds a simulated case of the study has.
    """

    name: str
    block: CaseBlock
    actuator: CombDrive
    study_seeds: int

    @property
    def title(self) -> str:
        """Name in print."""
        return self.name if self.block.title is None else self.block.title

    @property
    def recorded(self) -> bool:
        """Whether its trace was recorded, not simulated."""
        return self.block.recorded

    @property
    def seeds(self) -> int:
        """Number of traces; of a recorded one there is one."""
        return 1 if self.recorded else self.study_seeds

    @cached_property
    def sample(self) -> Sample:
        """Constitutive model."""
        return self.block.sample.sample

    @property
    def parameters(self) -> dict[str, float]:
        """True values by name, SI units, branches as they relax; none of a recorded trace."""
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
        """What the paper reports of it."""
        return self.block.published or Published()

    @property
    def truth(self) -> Truth:
        """What is known of it."""
        return Truth(self.title, self.sample, self.parameters, self.published)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The protocol."""
        return self.block.protocol.torques(self.actuator)

    @cached_property
    def gripper(self) -> Gripper:
        """The true gripper where its jaws touch the sample."""
        neutral = self.block.gripper.neutral
        if self.size_m is None:
            return neutral
        touching = self.block.gripper.contact(self.actuator, self.size_m)
        return replace(neutral, reference_angle_deg=touching.reference_angle_deg)

    @property
    def stroke_rad(self) -> float:
        """What the comb drive's stroke leaves for gripping, after closing onto the sample."""
        stroke = math.radians(self.actuator.stroke_deg)
        if self.size_m is None:
            return stroke
        return stroke - self.block.gripper.contact(self.actuator, self.size_m).closing_rad

    @property
    def noise(self) -> Noise:
        """Noise added to the rotation."""
        return self.block.measurement.noise

    @property
    def sampling(self) -> Sampling:
        """When the rotation is sampled."""
        return self.block.measurement.sampling

    @property
    def samples(self) -> int:
        """Samples in a trace, unless it was recorded."""
        return len(self.sampling.over(torque_history(self.phases).end_s))

    @property
    def nonlinear_target(self) -> bool:
        """Whether the target is made by the nonlinear model."""
        return self.block.models.target == "nonlinear"

    @property
    def unilateral(self) -> bool:
        """Whether the jaws of its target press only, and let go where they would have to pull."""
        return self.block.contact == "unilateral"

    @property
    def file(self) -> str:
        """The recorded trace."""
        assert self.block.measurement.file is not None
        return self.block.measurement.file

    @property
    def columns(self) -> Columns:
        """Where in its file a recorded trace stands."""
        block = self.block.measurement
        assert block.time is not None
        assert block.rotation is not None
        return Columns(block.time, block.rotation, block.time_unit, block.rotation_unit)

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Range that is searched, by the name of the range."""
        return dict(vars(self.block.search_range))

    @property
    def is_calibrated(self) -> bool:
        """Whether its identification takes the gripper's arms from a calibration."""
        return self.block.assumed_gripper == CALIBRATED

    @property
    def calibration(self) -> CalibrationTest:
        """The test without sample."""
        return self.block.calibration

    @cached_property
    def problem(self) -> CaseProblem:
        """What its identification assumes; a calibration replaces the gripper's arms."""
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
            offset=measurement.offset or measurement.coloured,
            drift=measurement.drift or measurement.coloured,
            noise_rad=measurement.noise_rad,
            coloured=measurement.coloured,
            uncertainty=self.block.gripper.uncertainties,
        )

    def method(self, name: str) -> object:
        """Settings of an identifier."""
        return self.block.of_methods.of(name)

    @property
    def mutation_start(self) -> int:
        """First generation whose children mutate."""
        settings = self.block.of_methods.block("genetic_algorithm")
        assert isinstance(settings, GeneticSettings)
        return settings.mutation_start

    @property
    def confidence(self) -> float:
        """Confidence of all intervals."""
        return self.block.identifiability.confidence

    @property
    def posterior(self) -> PosteriorSettings | None:
        """How the posterior of its first trace is sampled, if it is."""
        return self.block.posterior

    @property
    def coverage_seeds(self) -> int:
        """Over how many seeds intervals are held against the truth: none without noise."""
        tried = not self.recorded and not self.noise.absent
        return self.block.identifiability.coverage_seeds if tried else 0

    @property
    def has_valley(self) -> bool:
        """Whether two exchangeable parameters are searched, among others."""
        model = self.sample.model
        pair = [name for name in model.exchangeable if name not in self.fixed]
        return len(pair) == 2 and len(model.names) - len(self.fixed) > 2


@dataclass(frozen=True)
class Study:
    """A checked study.

    Parameters
    ----------
    config
        The whole config, every case with its blocks filled in.
    """

    config: StudyConfig

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Cases by name, in their order."""
        return self._cases(self.config.cases)

    @cached_property
    def points(self) -> dict[str, Case]:
        """The cases that the points of the sweeps are, by name."""
        blocks = point_blocks(self.sweeps, self.config.cases)
        return self._cases({name: built(CaseBlock, block) for name, block in blocks.items()})

    @cached_property
    def sweeps(self) -> dict[str, Sweep]:
        """Sweeps by name."""
        return sweeps_of(self.config.sweeps)

    @cached_property
    def readings(self) -> dict[str, dict[str, Case]]:
        """The simulated cases under each reading, by its name and theirs."""
        found: dict[str, dict[str, Case]] = {name: {} for name in self.config.readings}
        for reading, name, block in read_blocks(self.config.readings, self.config.cases):
            found[reading] |= self._cases({name: built(CaseBlock, block)})
        return found

    def _cases(self, blocks: Mapping[str, CaseBlock]) -> dict[str, Case]:
        actuator, seeds = self.config.actuator, self.config.seeds
        return {name: Case(name, block, actuator, seeds) for name, block in blocks.items()}

    def case(self, name: str) -> Case:
        """Return a case, or the case that a point of a sweep is."""
        return self.cases[name] if name in self.cases else self.points[name]

    @property
    def study_seed(self) -> int:
        """The one seed of the study."""
        return self.config.study_seed

    @property
    def methods(self) -> list[str]:
        """Identifiers; tables and figures that show one show the first."""
        return list(self.config.methods)

    @property
    def identifiers(self) -> dict[str, Method]:
        """What is said of them, by name; in the settings of what says it."""
        return {name: METHODS[name] for name in self.methods}

    @property
    def shown(self) -> str:
        """The method that tables and figures of one method show."""
        return self.methods[0]

    @property
    def selects_models(self) -> bool:
        """Whether every trace is fitted with several sample models."""
        return bool(self.config.model_selection.models)

    def models_of(self, case: Case) -> tuple[str, ...]:
        """Name the sample models that a case's traces are fitted with, see `CANDIDATES`."""
        return tuple(dict.fromkeys((*self.config.model_selection.models, case.sample.candidate)))

    @property
    def batch_size(self) -> int | None:
        """Number of seeds a job, if the study says."""
        return self.config.batch_size

    @property
    def near_noise_tolerance(self) -> float:
        """By which share a misfit may exceed the noise, to be taken for as good."""
        return self.config.evaluation.near_noise_tolerance

    @property
    def optimum_tolerance(self) -> float:
        """By how much chi-squared may exceed the lowest known, to be taken for as low."""
        return self.config.evaluation.optimum_tolerance

    @property
    def gripper(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return self.config.gripper.neutral

    @property
    def jaw_gap_m(self) -> float:
        """Distance between the jaws there."""
        return self.config.gripper.jaw_gap_m

    @property
    def actuator(self) -> CombDrive:
        """The comb drives."""
        return self.config.actuator

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The protocol of all cases if it is the same, else of those without one of their own."""
        own = {case.phases for case in self.cases.values()}
        return own.pop() if len(own) == 1 else self.config.protocol.torques(self.config.actuator)

    @property
    def ranges(self) -> dict[str, GeneRange]:
        """Range that is searched, of cases without one of their own."""
        return dict(vars(self.config.search_range))

    def reconstructed(self, block: str) -> tuple[str, ...]:
        """Keys of a block, or the block itself, whose values the paper does not give."""
        marked = self.config.reconstructed
        return tuple(key for key in marked if key == block or key.startswith(f"{block}."))

    def is_reconstructed(self, key: str) -> bool:
        """Whether the paper does not give the value of a dotted key."""
        marked = self.config.reconstructed
        return any(key == name or key.startswith(f"{name}.") for name in marked)

    @property
    def simulated(self) -> list[str]:
        """Cases with a target."""
        return [name for name, case in self.cases.items() if not case.recorded]

    @property
    def recorded(self) -> list[str]:
        """Cases whose trace was recorded."""
        return [name for name, case in self.cases.items() if case.recorded]

    @property
    def covered(self) -> list[str]:
        """Cases whose intervals are tested."""
        return [name for name, case in self.cases.items() if case.coverage_seeds > 0]

    @property
    def sampled(self) -> list[str]:
        """Cases whose posterior is sampled."""
        return [name for name, case in self.cases.items() if case.posterior is not None]

    @property
    def published(self) -> list[str]:
        """Cases that the paper reports on."""
        return [name for name, case in self.cases.items() if case.published.table is not None]
