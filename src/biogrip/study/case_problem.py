"""The identification problem of a case, from the settings that its jobs are handed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.calibrated_gripper import read_calibrated_arms
from biogrip.gripper import Gripper
from biogrip.identify.genome import GeneRange
from biogrip.identify.problem import Problem, condensed_of, problem_of
from biogrip.protocol import TorqueHistory
from biogrip.response.condensed import Condensed
from biogrip.sample import SampleModel, with_fixed
from biogrip.study import build


@dataclass(frozen=True)
class CaseProblem:
    """What the identification of a case assumes, whatever the trace.

    Parameters
    ----------
    gripper, torque, ranges, nonlinear, offset, drift, noise_rad
        As of `problem_of`.
    model, searched
        Sample model, and the same without the parameters that are known.
    fixed
        Those, by name.
    """

    gripper: Gripper
    torque: TorqueHistory
    ranges: dict[str, GeneRange]
    nonlinear: bool
    offset: bool
    drift: bool
    noise_rad: float | None
    model: SampleModel
    searched: SampleModel
    fixed: dict[str, float]
    _condensed: dict[bytes, Condensed] = field(default_factory=dict, init=False)

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
            self.ranges,
            nonlinear=self.nonlinear,
            offset=self.offset,
            drift=self.drift,
            noise_rad=noise_rad or self.noise_rad,
            condensed=self._condensed_at(time_s),
        )

    def _condensed_at(self, time_s: Array) -> Condensed:
        # Once for all traces of a case: it takes as long as some fifty responses.
        sampled = time_s.tobytes()
        if sampled not in self._condensed:
            self._condensed[sampled] = condensed_of(
                self.torque, time_s, offset=self.offset, drift=self.drift
            )
        return self._condensed[sampled]

    def logs(self, parameters: Mapping[str, float]) -> Array:
        """Logarithms of the searched parameters' values, zeros lifted into the search range."""
        chosen = [(parameters[p.name], self.ranges[p.range_name]) for p in self.searched.parameters]
        return np.log([max(value, genes.low) for value, genes in chosen])


def case_problem(settings: Mapping[str, Any], calibrated: Path | None = None) -> CaseProblem:
    """Build what a case assumes.

    Parameters
    ----------
    settings
        ``gripper``, ``protocol`` (and ``actuator``, if that is in volts), ``model``,
        ``branches``, ``nonlinear``, ``offset``, ``drift``, ``noise_rad``, ``fixed``,
        ``search_range``.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.

    Raises
    ------
    BiogripError
        If the calibration cannot be read.
    """
    gripper = build.gripper(settings["gripper"])
    if calibrated is not None:
        gripper = read_calibrated_arms(calibrated, gripper)
    model = build.sample_model(settings)
    return CaseProblem(
        gripper,
        build.torque(settings),
        build.gene_ranges(settings["search_range"]),
        settings["nonlinear"],
        settings["offset"],
        settings["drift"],
        settings["noise_rad"],
        model,
        with_fixed(model, settings["fixed"]),
        settings["fixed"],
    )
