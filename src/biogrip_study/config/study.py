"""From config files to a study and its cases, or to messages that name file, line and key.

The study's blocks are merged into every case before it is checked. Points of sweeps, and cases
under other readings of the paper, are checked as if they were cases of the config.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from biogrip.config.case import SampleCase
from biogrip.config.loading import checked, load, read_configs, refuse, trace_defaults
from biogrip.config.source import Source, keys_in, overlaid, read_source, values_in
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.keys import Complaint, below, built, plain
from biogrip.physics.gripper import CombDrive, Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.protocol import Phase
from biogrip_study.config.shipped import default_config
from biogrip_study.config.study_blocks import (
    OVERRIDABLE,
    UNPUBLISHED,
    CaseBlock,
    Published,
    StudyConfig,
    list_points,
    point_blocks,
)
from biogrip_study.gripper.calibration import with_calibration
from biogrip_study.methods.registry import METHODS, Method

DEFAULTS = trace_defaults(), default_config()
"""Config files over which that of a study is laid."""


@dataclass(frozen=True)
class Case(SampleCase):
    """A case of the study: what is simulated, and what the paper reports of it."""

    block: CaseBlock
    study: "Study" = field(kw_only=True)

    @property
    def title(self) -> str:
        """Name in print."""
        return self.block.title or self.name

    @property
    def published(self) -> Published:
        """What the paper reports of the case."""
        return self.block.published or UNPUBLISHED

    @property
    def seeds(self) -> int:
        """Number of traces; 1 for a recorded trace."""
        return 1 if self.recorded else self.study.config.seeds

    @property
    def coverage_seeds(self) -> int:
        """Number of seeds to test the coverage of intervals with; 0 without noise."""
        tried = not self.recorded and not self.noise.absent
        return self.block.identifiability.coverage_seeds if tried else 0

    @property
    def nonlinear_target(self) -> bool:
        """True if targets are simulated by the nonlinear equations."""
        return self.block.models.target == "nonlinear"

    @property
    def assumed_gripper(self) -> Gripper:
        """Gripper that identifications assume; a calibration replaces its arms."""
        assumed = self.block.assumed_gripper
        if isinstance(assumed, Mapping):
            return built(Gripper, overlaid(plain(self.gripper), assumed))
        return self.gripper

    @cached_property
    def experiment(self) -> Experiment:
        """What was done, for any identification, with the arms of a calibration if there is one."""
        calibration = self.study.calibrations.get(self.name)
        experiment = super().experiment
        return with_calibration(experiment, calibration) if calibration else experiment


@dataclass(frozen=True)
class Study:
    """A study whose config has been checked."""

    config: StudyConfig
    """The whole config, with the study's blocks merged into every case."""
    only: tuple[str, ...] | None = None
    """Names of its cases; by default those of the config."""
    calibrations: Mapping[str, Path] = field(default_factory=dict)
    """Files of calibrated grippers, by the names of their cases."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config as plain values, without keys that have their default."""
        return plain(self.config)

    @cached_property
    def cases(self) -> dict[str, Case]:
        """Cases by name, in the order of the config."""
        blocks = self.config.cases
        names = blocks if self.only is None else self.only
        return {name: Case(name, blocks[name], self.config, study=self) for name in names}

    @cached_property
    def points(self) -> dict[str, Case]:
        """Cases of all points of the sweeps, by name."""
        blocks = point_blocks(self.config.sweeps, self.config.cases)
        return {
            name: Case(name, built(CaseBlock, block), self.config, study=self)
            for name, block in blocks.items()
        }

    def case(self, name: str) -> Case:
        """Return a case of the study or of a sweep's point."""
        return self.cases[name] if name in self.cases else self.points[name]

    def of(self, names: Iterable[str]) -> "Study":
        """Return the study of some of its cases."""
        return replace(self, only=tuple(names))

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


def load_given_study(given: Mapping[str, Any], files: Sequence[Path]) -> Study:
    """Lay a config over the default study's, and check and type it, see `load_study`.

    What is not in the files as it is in the config, was given on Snakemake's command line.
    """
    read = dict(values_in(read_configs(files)))
    typed = [path for path, value in values_in(given) if read.get(path) != value]
    over = ("command line, --config", dict.fromkeys(typed))
    config = overlaid(read_configs(DEFAULTS), given)
    return load_study(config, [*DEFAULTS, *files], [over])


def load_study(
    config: Mapping[str, Any], files: Iterable[Path], over: Iterable[Source] = ()
) -> Study:
    """Check and type a merged config, which came from files, and from what is `over` them.

    A `BiogripError` names file, line and key of the first few complaints, with what was found and
    what is allowed.
    """
    sources = [*map(read_source, files), *over]
    try:
        study = load(StudyConfig, config, sources, OVERRIDABLE)
        study = replace(
            study, cases={name: study.cases[name] for name in study.only or study.cases}
        )
        complaints = [*_point_complaints(study), *_reading_complaints(study)]
        known = {*keys_in(config)}
        for index, key in enumerate(study.reconstructed):
            if tuple(key.split(".")) not in known:
                text = f"found '{key}', allowed is a key of this study."
                complaints.append((("reconstructed", index), text))
        refuse(complaints, sources, OVERRIDABLE)
    except BiogripError as error:
        text = f"The study's configuration cannot be used.\n{error}"
        raise BiogripError(text) from error
    return Study(study)


def _point_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every point of every sweep as if it were a case of the config."""
    blocks = point_blocks(study.sweeps, study.cases)
    for name, point in list_points(study.sweeps):
        case, complaints = checked(CaseBlock, blocks[point.name])
        for complaint in case.comb_complaints(study.actuator) if case else complaints:
            yield from below(("sweeps", name), [study.sweeps[name].placed(point, complaint)])


def _reading_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every simulated case under every reading as if it were a case of the config."""
    for name, block in study.readings.items():
        for case in study.cases.values():
            if not case.recorded:
                complaints = checked(CaseBlock, overlaid(plain(case), block.changes))[1]
                yield from below(("readings", name, "changes"), complaints)
