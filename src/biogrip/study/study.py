"""From config files to a study and its cases, or to messages that name file, line and key.

The study's blocks are merged into every case before it is checked. Points of sweeps, and cases
under other readings of the paper, are checked as if they were cases of the config.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import Any

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.genome import GeneRange, SearchRange
from biogrip.fit.problem import METHODS, Method
from biogrip.keys import Complaint, below, built, plain
from biogrip.physics.gripper import NO_ARMS, CombDrive, Contact, Gripper
from biogrip.physics.instruments import GRIPPER, Instrument
from biogrip.physics.models import CANDIDATES, UNPUBLISHED, Published, Sample
from biogrip.physics.noise import Noise
from biogrip.physics.protocol import Course, Phase, join_phases, sample_times
from biogrip.physics.sample_model import Network, with_fixed
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock
from biogrip.study.config import StudyConfig, list_points, point_blocks
from biogrip.study.messages import checked, with_numbers
from biogrip.study.source import (
    KeyPath,
    Source,
    default_config,
    dotted,
    overlaid,
    place,
    read_config,
    read_source,
    values_in,
)


@dataclass(frozen=True)
class Case:
    """A case of the study: one sample with its experiment and identification."""

    name: str
    """Name used in files."""
    block: CaseBlock
    """Config block, with the study's blocks merged in."""
    study: "Study"
    record: Array | None = None
    """What was controlled in a recorded trace, if it was recorded; see `Experiment.record`."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config block as plain values, without keys that have their default."""
        return plain(self.block)

    @property
    def title(self) -> str:
        """Name in print."""
        return self.block.title or self.name

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.block.recorded

    @property
    def published(self) -> Published:
        """What the paper reports of the case."""
        return self.block.published or UNPUBLISHED

    @property
    def seeds(self) -> int:
        """Number of traces; 1 for a recorded trace."""
        return 1 if self.recorded else self.study.config.seeds

    @property
    def confidence(self) -> float:
        """Confidence level of all intervals."""
        return self.block.identifiability.confidence

    @property
    def coverage_seeds(self) -> int:
        """Number of seeds to test the coverage of intervals with; 0 without noise."""
        tried = not self.recorded and not self.noise.absent
        return self.block.identifiability.coverage_seeds if tried else 0

    @property
    def noise(self) -> Noise:
        """Noise of simulated traces."""
        return self.block.measurement.noise

    @cached_property
    def times_s(self) -> Array:
        """Times of a simulated trace, (n_samples,)."""
        return sample_times(self.torque.end_s, self.block.measurement.rate_Hz)

    @property
    def instrument(self) -> Instrument:
        """The instrument, by its kind, and by what the protocol holds and the trace is of."""
        return self.block.instrument_used

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of the protocol, in torques or what else the instrument holds."""
        return self.block.protocol.make_phases(self.instrument, self.study.actuator)

    @cached_property
    def torque(self) -> Course:
        """What the instrument holds over time."""
        return join_phases(self.phases, deforms=self.instrument.deforms)

    @cached_property
    def _contact(self) -> Contact | None:
        """State of the gripper when it is closed onto the sample, if its size is known."""
        size_m = self.block.sample.size_m
        return None if size_m is None else self.block.gripper.contact(self.study.actuator, size_m)

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
        return math.radians(self.study.actuator.stroke_deg) - closing

    @cached_property
    def sample(self) -> Sample:
        """Constitutive model."""
        return replace(self.block.sample.sample, stiffness=self.instrument.stiffness)

    @property
    def parameters(self) -> dict[str, float]:
        """True parameters by name, SI units, branches by relaxation time; none if recorded."""
        given, model = self.block.sample.parameters, self.sample.model
        known = {name: given[name] for name in model.names if name in given}
        whole = len(known) == len(model.names)
        return with_fixed(model, self.block.fixed).named_in_order(known) if whole else known

    @cached_property
    def network(self) -> Network:
        """Springs and dampers of the simulated sample."""
        return self.sample.model.sample(self.parameters)

    @property
    def nonlinear_target(self) -> bool:
        """True if targets are simulated by the nonlinear equations."""
        return self.block.models.target == "nonlinear"

    @property
    def unilateral(self) -> bool:
        """True if the jaws of the simulation cannot pull the sample."""
        return self.block.contact == "unilateral"

    @cached_property
    def experiment(self) -> Experiment:
        """What was done, for any identification; a calibration replaces the gripper's arms."""
        assumed, measurement = self.block.assumed_gripper, self.block.measurement
        gripper = self.gripper
        if isinstance(assumed, Mapping):
            gripper = built(Gripper, overlaid(plain(gripper), assumed))
        uncertainty = self.block.gripper.uncertainty if self.instrument.has_jaws else None
        ranges, usual = dict[str, GeneRange](vars(self.block.search_range)), default_ranges()
        return Experiment(
            gripper,
            self.phases,
            ranges,
            self.sample,
            self.block.fixed,
            self.instrument,
            offset=measurement.along["offset"],
            drift=measurement.along["drift"],
            noise_sd=measurement.noise_rad,
            noise_share=measurement.noise_share,
            coloured=measurement.coloured,
            uncertainty=uncertainty.by_part if uncertainty else {},
            fit_start=measurement.fit_start,
            record=self.record,
            undeclared=frozenset(
                it for it in measurement.along if getattr(measurement, it) is None
            ),
            given_ranges=frozenset(name for name, it in ranges.items() if it != usual[name]),
            simulated=not self.recorded,
            name=self.name,
        )

    @property
    def judged_experiment(self) -> Experiment:
        """What was done, and how a trace is judged."""
        judged = replace(
            self.experiment,
            least_squares=self.block.least_squares,
            confidence=self.confidence,
            study_seed=self.study.config.study_seed,
        )
        if not self.recorded:
            return judged
        measured, models = self.block.measurement, self.study.config.model_selection.models
        # A recorded load that is there in its first row came before that.
        known = measured.fit_start or (self.record is not None and not self.record[0, 1])
        default = read_config(default_config())["model_selection"]["models"]
        return replace(
            judged,
            start_given=known or measured.start_s is not None,
            models=models,
            usual_models=[*models] == default,
        )

    @property
    def models(self) -> dict[str, Sample]:
        """Sample models to fit to the case's traces by name, see `CANDIDATES`."""
        names = (*self.study.config.model_selection.models, self.sample.candidate)
        unit = self.instrument.stiffness
        return {name: replace(CANDIDATES[name], stiffness=unit) for name in names}

    @property
    def has_trade_off(self) -> bool:
        """True if two exchangeable parameters are searched, and others besides."""
        searched = [parameter.name for parameter in self.block.searched]
        pair = {*self.sample.model.exchangeable} & {*searched}
        return len(pair) == 2 and len(searched) > 2


@dataclass(frozen=True)
class Study:
    """A study whose config has been checked."""

    config: StudyConfig
    """The whole config, with the study's blocks merged into every case."""
    only: tuple[str, ...] | None = None
    """Names of its cases; by default those of the config."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config as plain values, without keys that have their default."""
        return plain(self.config)

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Cases by name, in the order of the config."""
        blocks = self.config.cases
        names = blocks if self.only is None else self.only
        return {name: Case(name, blocks[name], self) for name in names}

    @cached_property
    def points(self) -> dict[str, Case]:
        """Cases of all points of the sweeps, by name."""
        blocks = point_blocks(self.config.sweeps, self.config.cases)
        return {name: Case(name, built(CaseBlock, block), self) for name, block in blocks.items()}

    def case(self, name: str) -> Case:
        """Return a case of the study or of a sweep's point."""
        return self.cases[name] if name in self.cases else self.points[name]

    def of(self, names: Iterable[str]) -> "Study":
        """Return the study of some of its cases."""
        return Study(self.config, tuple(names))

    def _where(self, holds: Callable[[Case], bool]) -> list[str]:
        return [name for name, case in self.cases.items() if holds(case)]

    @property
    def simulated(self) -> list[str]:
        """Names of cases that are simulated."""
        return self._where(lambda case: not case.recorded)

    @property
    def recorded(self) -> list[str]:
        """Names of cases with a recorded trace."""
        return self._where(lambda case: case.recorded)

    @property
    def gripped(self) -> list[str]:
        """Names of simulated cases whose sample the gripper holds."""
        return self._where(lambda case: not case.recorded and case.instrument.has_jaws)

    @property
    def covered(self) -> list[str]:
        """Names of cases whose intervals are tested for coverage."""
        return self._where(lambda case: case.coverage_seeds > 0)

    @property
    def counted(self) -> list[str]:
        """Names of those of which every trace gets the verdicts that users are shown."""
        covered = self.of(self.covered)
        return covered._where(lambda case: case.block.identifiability.verdicts_every == 1)

    @property
    def published(self) -> list[str]:
        """Names of cases that the paper reports results of."""
        return self._where(lambda case: case.published.table is not None)

    @property
    def near_noise_tolerance(self) -> float:
        """Share by which the misfit of a seed near the noise exceeds its noise at most."""
        return self.config.evaluation.near_noise_tolerance

    @property
    def optimum_tolerance(self) -> float:
        """Excess of χ² over that of the best encodable point, of runs that reach it, at most."""
        return self.config.evaluation.optimum_tolerance

    @property
    def gripper(self) -> Gripper:
        """The gripper in its neutral configuration."""
        return self.config.gripper.neutral

    @property
    def actuator(self) -> CombDrive:
        """The rotary comb drive."""
        return self.config.actuator

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Protocol of all cases if it is the same, else of the study."""
        of_cases = {case.phases for case in self.cases.values()}
        if len(of_cases) == 1:
            return of_cases.pop()
        return self.config.protocol.make_phases(GRIPPER, self.actuator)

    @property
    def shown_method(self) -> Method:
        """Method that tables and figures of a single method show."""
        return METHODS[self.config.methods[0]]

    @property
    def fitting_method(self) -> Method:
        """Least squares if the study has it, else the shown method."""
        has_it = "least_squares" in self.config.methods
        return METHODS["least_squares"] if has_it else self.shown_method


_SHOWN = 6


def default_ranges() -> dict[str, GeneRange]:
    """Return the search ranges of the default study."""
    found = built(SearchRange, read_config(default_config())["search_range"])
    return dict[str, GeneRange](vars(found))


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and merge them, the later over the earlier, see `read_config`."""
    return reduce(overlaid, map(read_config, files), {})


def load_given_study(given: Mapping[str, Any], files: Sequence[Path]) -> Study:
    """Lay a config over the default study's, and check and type it, see `load_study`.

    What is not in the files as it is in the config, was given on Snakemake's command line.
    """
    read = dict(values_in(read_configs(files)))
    typed = [path for path, value in values_in(given) if read.get(path) != value]
    over = ("command line, --config", dict.fromkeys(typed))
    config = overlaid(read_config(default_config()), given)
    return load_study(config, [default_config(), *files], [over])


def load_study(
    config: Mapping[str, Any], files: Iterable[Path], over: Iterable[Source] = ()
) -> Study:
    """Check and type a merged config, which came from files, and from what is `over` them.

    A `BiogripError` names file, line and key of the first few complaints, with what was found and
    what is allowed.
    """
    sources = [*map(read_source, files), *over]
    study, complaints = checked(StudyConfig, _fill_in(with_numbers(StudyConfig, config)))
    _refuse(complaints, sources)
    assert study is not None
    study = replace(study, cases={it: study.cases[it] for it in study.only or study.cases})
    _refuse([*_point_complaints(study), *_reading_complaints(study)], sources)
    return Study(study)


def _refuse(complaints: Iterable[Complaint], sources: Sequence[Source]) -> None:
    found: dict[str, None] = {}
    for path, text in complaints:
        # A complaint in a block that cases inherit is reported once, not once per case.
        origin = _origin(path, sources)
        found[f"{place(origin, sources)}: {dotted(origin)}: {text}"] = None
    if found:
        shown = [*found][:_SHOWN]
        more = [f"... and {len(found) - _SHOWN} more."] if len(found) > _SHOWN else []
        raise BiogripError("\n".join(["The study's configuration cannot be used.", *shown, *more]))


def _origin(path: KeyPath, sources: Sequence[Source]) -> KeyPath:
    """Return the path of the study-wide key that a case inherits, or the path itself."""
    if len(path) < 3 or path[0] != "cases" or path[2] not in OVERRIDABLE:
        return path
    for length in range(len(path), 2, -1):
        if any(path[:length] in lines for _, lines in sources):
            return path
        if any(path[2:length] in lines for _, lines in sources):
            break
    return path[2:]


def _point_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every point of every sweep as if it were a case of the config."""
    blocks = point_blocks(study.sweeps, study.cases)
    for name, point in list_points(study.sweeps):
        case, found = checked(CaseBlock, blocks[point.name])
        for complaint in case.comb_complaints(study.actuator) if case else found:
            yield from below(("sweeps", name), [study.sweeps[name].placed(point, complaint)])


def _reading_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every simulated case under every reading as if it were a case of the config."""
    for name, block in study.readings.items():
        for case in study.cases.values():
            if not case.recorded:
                complaints = checked(CaseBlock, overlaid(plain(case), block.changes))[1]
                yield from below(("readings", name, "changes"), complaints)


def _fill_in(config: Mapping[str, Any]) -> Mapping[str, Any]:
    """Merge the study's blocks into every case; drop cases set to nothing."""
    if not isinstance(cases := config.get("cases"), dict):
        return config
    shared = {name: config[name] for name in OVERRIDABLE if name in config}
    filled = {name: overlaid(shared, case) for name, case in cases.items() if case is not None}
    return {**config, "cases": filled}
