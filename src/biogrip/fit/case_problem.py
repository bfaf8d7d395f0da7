"""Assumptions of the identification that all traces of a case share."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.genome import GeneRange
from biogrip.fit.problem import Problem, make_problem, searched
from biogrip.physics.calibration import read_calibrated_arms
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.models import Sample
from biogrip.physics.protocol import Phase, TorqueHistory, torque_history
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.physics.whitening import (
    WEIGHTED,
    NoiseModel,
    Whitening,
    nuisance_basis,
    with_uncertain,
)

NOT_FITTED = "inertia_kgm2"
"""Key of an arm that fits leave out, and its uncertainty with it."""


@dataclass(frozen=True)
class CaseProblem:
    """Assumptions of the identification that all traces of a case share."""

    gripper: Gripper
    """Gripper of the simulated responses."""
    phases: tuple[Phase, ...]
    """The protocol."""
    ranges: Mapping[str, GeneRange]
    """Search ranges by `Parameter.range_name`."""
    sample: Sample
    """Constitutive model."""
    fixed: Mapping[str, float]
    """Parameters that are known, by name."""
    instrument: Instrument
    """What is held and read; other than a gripper, it has `NO_ARMS`."""
    offset: bool = False
    """True if the instrument may have added a constant."""
    drift: bool = False
    """True if it may have added a drift linear in time."""
    noise_rad: float | None = None
    """Standard deviation of the noise, if it is known."""
    noise_share: float | None = None
    """Standard deviation of the noise as a share of the rotation; read by `read_checked`."""
    sd_rad: Array | None = field(default=None, compare=False)
    """Standard deviations of the readings of a trace, see `weighted`, (n_samples,)."""
    coloured: bool = False
    """True if the noise of a trace may be autocorrelated, see `trace_fit`."""
    uncertainty: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Standard uncertainties by part and key: of ``left`` and ``right``, the arms; of the
    ``gripper`` itself; and ``share`` of the ``torque``."""
    fit_start: bool = False
    """True if the time at which the protocol started is fitted along, see `fitted_onset`."""

    @cached_property
    def torque(self) -> TorqueHistory:
        """Torque of both arms, or what else is held, against time."""
        return torque_history(self.phases, deforms=self.instrument.deforms)

    @cached_property
    def model(self) -> SampleModel:
        """Sample model."""
        return self.sample.model

    @cached_property
    def searched(self) -> SampleModel:
        """Sample model without the fixed parameters."""
        return with_fixed(self.model, self.fixed)

    def to_identify(self, *others: SampleModel) -> "CaseProblem":
        """Leave out noise model, gripper uncertainty, and ranges neither it nor `others` use."""
        chosen = {p.range_name for model in (self.model, *others) for p in model.parameters}
        ranges = {name: genes for name, genes in self.ranges.items() if name in chosen}
        return replace(self, ranges=ranges, coloured=False, uncertainty={})

    def weighted(self, sd_rad: Array | None) -> "CaseProblem":
        """Divide the readings of a trace by their standard deviations, if these are known.

        The noise becomes white, with their root mean square as its standard deviation.
        """
        if sd_rad is None:
            return self
        return replace(self, sd_rad=sd_rad, noise_rad=float(np.sqrt(np.mean(sd_rad**2))))

    @property
    def unknowns(self) -> int:
        """Number of parameters that are fitted to a trace, those of the instrument included."""
        return len(self.searched.names) + self.offset + self.drift + self.fit_start

    @property
    def uncertain_keys(self) -> list[str]:
        """Parts and keys of the gripper whose uncertainty changes what a fit simulates."""
        return [
            f"{part}.{key}"
            for part, known in self.uncertainty.items()
            for key in known
            if known[key] and key != NOT_FITTED
        ]

    @property
    def plain(self) -> bool:
        """True if noise is assumed to be white, and the gripper to be known exactly."""
        return not self.coloured and not self.uncertain_keys

    def calibrated(self, files: Sequence[Path]) -> "CaseProblem":
        """Take the arms of the first calibration file (YAML), if there is one.

        Raises
        ------
        BiogripError
            If the calibration cannot be read.
        """
        if not files:
            return self
        gripper, uncertainty = read_calibrated_arms(files[0], self.gripper)
        return replace(self, gripper=gripper, uncertainty={**self.uncertainty, **uncertainty})

    def of(
        self,
        time_s: Array,
        rotation_rad: Array,
        model: SampleModel | None = None,
        noise_rad: float | None = None,
        condensed: Condensed | None = None,
    ) -> Problem:
        """Pose the problem of a trace.

        `model`, `noise_rad`, and `condensed` from `in_noise` replace those of the case.
        """
        return make_problem(
            self.gripper,
            model or self.searched,
            self.torque,
            time_s,
            rotation_rad,
            self.ranges,
            self.condensed(time_s) if condensed is None else condensed,
            noise_rad=noise_rad or self.noise_rad,
            instrument=self.instrument,
        )

    def of_each(
        self,
        time_s: Array,
        traces: Iterable[Array],
        model: SampleModel | None = None,
        condensed: Condensed | None = None,
    ) -> list[Problem]:
        """Pose the problems of traces with the same times, which are then fitted together.

        Rows are condensed once, for that takes as long as some fifty responses. Whoever poses
        several groups gives all of them the same rows, from `condensed`.
        """
        rows = self.condensed(time_s) if condensed is None else condensed
        return [self.of(time_s, trace, model, condensed=rows) for trace in traces]

    def condensed(self, time_s: Array) -> Condensed:
        """Condense the readings at ascending times, weighted if `sd_rad` is known."""
        if self.sd_rad is not None:
            return self.in_noise(time_s, None, np.zeros((0, len(time_s))))
        return self._condense(time_s, self.nuisance(time_s))

    def sets_condensed(self, time_s: Array) -> tuple[Hashable, ...]:
        """Return all that these condensed rows depend on."""
        sd = None if self.sd_rad is None else self.sd_rad.tobytes()
        held = self.phases, self.instrument, self.offset, self.drift
        return *held, sd, time_s.tobytes()

    def for_model(self, problem: Problem, model: SampleModel) -> Problem:
        """Return one of its problems posed for another model; both share rows of the trace."""
        residuals = problem.residuals.of_model(model)
        return searched(residuals.condensed_misfit, residuals, self.ranges)

    def nuisance(self, time_s: Array) -> Array:
        """Return the nuisance functions, offset and drift, (n_functions, n_samples)."""
        return nuisance_basis(time_s, offset=self.offset, drift=self.drift)

    def in_noise(
        self,
        time_s: Array,
        noise_model: NoiseModel | None,
        uncertain: Array,
        *,
        growing: Array | None = None,
    ) -> Condensed:
        """Condense the readings for autocorrelated noise or an uncertain gripper.

        Parameters
        ----------
        time_s : (n_samples,)
            Ascending sampling times.
        noise_model
            Autocorrelation model of the noise; None if it is white.
        uncertain : (n_functions, n_samples)
            Functions added with a random amplitude, see `with_uncertain`.
        growing : (n_samples,), optional
            Rotation that noise grows with, see `Whitening`.
        """
        nuisance, whitening = self.nuisance(time_s), None
        if noise_model is None and self.sd_rad is not None:
            noise_model, growing = WEIGHTED, self.sd_rad
        if noise_model is not None:
            whitening = Whitening(time_s, noise_model, nuisance, uncertain, growing)
        return self._condense(time_s, with_uncertain(nuisance, uncertain), whitening)

    def _condense(
        self, time_s: Array, basis: Array, whitening: Whitening | None = None
    ) -> Condensed:
        return Condensed(self.torque, time_s, basis, whitening=whitening)

    def logs(self, parameters: Mapping[str, float]) -> Array:
        """Return log-parameters of the searched parameters, zeros replaced by the lower bound."""
        chosen = [(parameters[p.name], self.ranges[p.range_name]) for p in self.searched.parameters]
        return np.log([max(value, genes.low) for value, genes in chosen])
