"""What the identification of a case assumes, whatever the trace."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import Sample, SampleModel, with_fixed
from biogrip.identify.genome import GeneRange
from biogrip.identify.problem import Problem, condensed_of, for_model, problem_of
from biogrip.instrument.calibrated_gripper import read_calibrated_arms
from biogrip.instrument.gripper import Gripper
from biogrip.response.condensed import Condensed


@dataclass(frozen=True)
class CaseProblem:
    """What the identification of a case assumes, whatever the trace.

    Parameters
    ----------
    gripper, ranges, nonlinear, offset, drift, noise_rad
        As of `problem_of`.
    phases
        The protocol.
    sample
        Constitutive model.
    fixed
        Parameters that are known, by name.
    """

    gripper: Gripper
    phases: tuple[Phase, ...]
    ranges: Mapping[str, GeneRange]
    sample: Sample
    fixed: Mapping[str, float]
    nonlinear: bool = False
    offset: bool = False
    drift: bool = False
    noise_rad: float | None = None
    _condensed: dict[bytes, Condensed] = field(default_factory=dict, init=False, compare=False)

    @cached_property
    def torque(self) -> TorqueHistory:
        """Torque of both arms against time."""
        return torque_history(self.phases)

    @cached_property
    def model(self) -> SampleModel:
        """Sample model."""
        return self.sample.model

    @cached_property
    def searched(self) -> SampleModel:
        """Sample model without the parameters that are known."""
        return with_fixed(self.model, self.fixed)

    def calibrated(self, files: Sequence[Path]) -> "CaseProblem":
        """Return the problem with the arms of a calibration, YAML, if there is one.

        Raises
        ------
        BiogripError
            If the calibration cannot be read.
        """
        if not files:
            return self
        return replace(self, gripper=read_calibrated_arms(files[0], self.gripper))

    def of(
        self,
        time_s: Array,
        rotation_rad: Array,
        model: SampleModel | None = None,
        noise_rad: float | None = None,
    ) -> Problem:
        """Pose the problem for a trace; a model and a level of noise replace the case's."""
        return problem_of(
            self.gripper,
            model or self.searched,
            self.torque,
            time_s,
            rotation_rad,
            dict(self.ranges),
            nonlinear=self.nonlinear,
            offset=self.offset,
            drift=self.drift,
            noise_rad=noise_rad or self.noise_rad,
            condensed=self._condensed_at(time_s),
        )

    def for_model(self, problem: Problem, model: SampleModel) -> Problem:
        """Pose one of its problems for another model, at less than the price of a new one."""
        return for_model(problem, model, dict(self.ranges))

    def _condensed_at(self, time_s: Array) -> Condensed:
        # Once for all traces of a case: it takes as long as some fifty responses.
        sampled = time_s.tobytes()
        if sampled not in self._condensed:
            self._condensed[sampled] = condensed_of(
                self.torque,
                time_s,
                offset=self.offset,
                drift=self.drift,
                nonlinear=self.nonlinear,
            )
        return self._condensed[sampled]

    def logs(self, parameters: Mapping[str, float]) -> Array:
        """Logarithms of the searched parameters' values, zeros lifted into the search range."""
        chosen = [(parameters[p.name], self.ranges[p.range_name]) for p in self.searched.parameters]
        return np.log([max(value, genes.low) for value, genes in chosen])
