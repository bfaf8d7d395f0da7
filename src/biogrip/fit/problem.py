"""The identification of one trace, what all traces of a case share, and the result of a method."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from weakref import WeakValueDictionary

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.genome import GeneRange, Genome, make_genome
from biogrip.fit.levenberg_marquardt import Minima
from biogrip.physics.calibration import read_calibrated_arms
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.models import Sample
from biogrip.physics.protocol import Course, Phase, join_phases
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.physics.whitening import (
    WEIGHTED,
    NoiseModel,
    Whitening,
    nuisance_basis,
    with_uncertain,
)

Progress = Callable[[int, float], None]
"""Callback that receives the number of simulated responses and the lowest misfit."""


Row = tuple[Array, float, float, int]
"""Row of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def silent(evaluations: int, misfit: float) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class History:
    """Course of an identification, step by step; the method defines what a step is."""

    best_misfit: Array
    """Lowest misfit so far in the unit of the readings, (n_steps + 1,)."""
    median_misfit: Array
    """Median over the method's population or fits, (n_steps + 1,)."""
    best_parameters: Array
    """Parameters of the lowest misfit, (n_steps + 1, n_parameters)."""
    evaluations: IntArray
    """Responses simulated so far, (n_steps + 1,)."""

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "History":
        """Assemble a history from its rows."""
        parameters, best_misfit, median_misfit, counts = map(np.array, zip(*rows, strict=True))
        return cls(best_misfit, median_misfit, parameters, counts)


@dataclass(frozen=True)
class Identification:
    """The result of identifying one trace by one method."""

    parameters: Array
    """Parameters of lowest misfit, (n_parameters,)."""
    misfit: float
    """RMS misfit of these parameters."""
    generations: int
    """Number of steps: generations, or local fits."""
    evaluations: int
    """Number of simulated responses; a response with its derivatives counts as one. Those of the
    final Newton refinement are not counted."""
    stop_reason: str
    """Reason why the method stopped."""
    history: History = field(repr=False)
    """Course of the identification."""
    converged: bool = True
    """False if the final Newton refinement of the optimum did not converge."""

    def at(self, fit: Minima) -> "Identification":
        """Return a copy with the optimum of a local fit of this trace alone."""
        misfit, converged = float(fit.misfit[0]), bool(fit.converged[0])
        return self.replaced(np.exp(fit.x[0]), misfit, converged=converged)

    def replaced(self, parameters: Array, misfit: float, *, converged: bool) -> "Identification":
        """Return a copy with other parameters and misfit, in its last row of history as well."""
        history = self.history
        best_misfit, best_parameters = history.best_misfit.copy(), history.best_parameters.copy()
        best_misfit[-1], best_parameters[-1] = misfit, parameters
        return replace(
            self,
            parameters=parameters,
            misfit=misfit,
            converged=converged,
            history=replace(history, best_misfit=best_misfit, best_parameters=best_parameters),
        )

    def in_order(self, model: SampleModel) -> "Identification":
        """Return a copy with Maxwell branches sorted by relaxation time, in its history as well."""
        way = self.history.best_parameters
        ordered = np.take_along_axis(way, model.in_order(way), axis=1)
        found = self.parameters[model.in_order(self.parameters[None])[0]]
        return replace(
            self, parameters=found, history=replace(self.history, best_parameters=ordered)
        )


@dataclass(frozen=True)
class Problem:
    """The identification of one trace, in the form that every method takes."""

    residuals: Residuals
    """Residuals with exact derivatives, and misfits, as functions of log-parameters."""
    genome: Genome
    """Encoding of the parameters for the genetic algorithm."""
    low: Array
    """Logarithms of the lower ends of the search range (Table 4), (n_parameters,)."""
    high: Array
    """Those of the upper ends."""

    def later(self, change_s: float) -> "Problem":
        """Return the problem of the same trace for a protocol that starts later by some s."""
        return replace(self, residuals=self.residuals.later(change_s))


def make_problem(residuals: Residuals, ranges: Mapping[str, GeneRange]) -> Problem:
    """Set up a problem from its residuals, and gene ranges by `Parameter.range_name`."""
    chosen = [ranges[parameter.range_name] for parameter in residuals.model.parameters]
    return Problem(
        residuals,
        make_genome(residuals.model, ranges),
        np.log([genes.low for genes in chosen]),
        np.log([genes.high for genes in chosen]),
    )


# Key of an arm that fits leave out, and its uncertainty with it.
_NOT_FITTED = "inertia_kgm2"
# Rows that some problem has, for traces of the same times to share: they are then fitted together,
# and rows take as long as some fifty responses.
_IN_USE: WeakValueDictionary[Hashable, Condensed] = WeakValueDictionary()


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
    noise_sd: float | None = None
    """Standard deviation of the noise, if it is known."""
    noise_share: float | None = None
    """Standard deviation of the noise as a share of the readings; read by `read_checked`."""
    sd: Array | None = field(default=None, compare=False)
    """Standard deviations of the readings of a trace, see `weighted`, (n_samples,)."""
    coloured: bool = False
    """True if the noise of a trace may be autocorrelated, see `fit_traces`."""
    uncertainty: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Standard uncertainties by part and key: of ``left`` and ``right``, the arms; of the
    ``gripper`` itself; and ``share`` of the ``torque``."""
    fit_start: bool = False
    """True if the time at which the protocol started is fitted along, see `fitted_onset`."""

    @cached_property
    def torque(self) -> Course:
        """Torque of both arms, or what else is held, against time."""
        return join_phases(self.phases, deforms=self.instrument.deforms)

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

    def weighted(self, sd: Array | None) -> "CaseProblem":
        """Divide the readings of a trace by their standard deviations, if these are known.

        The noise becomes white, with their root mean square as its standard deviation.
        """
        if sd is None:
            return self
        return replace(self, sd=sd, noise_sd=float(np.sqrt(np.mean(sd**2))))

    @property
    def unknowns(self) -> int:
        """Number of parameters that are fitted to a trace, those of the instrument included."""
        return len(self.searched.names) + self.offset + self.drift + self.fit_start

    @property
    def uncertain(self) -> list[tuple[str, str, float]]:
        """Parts, keys and standard uncertainties that change what a fit simulates."""
        return [
            (part, key, error)
            for part, known in self.uncertainty.items()
            for key, error in known.items()
            if error and key != _NOT_FITTED
        ]

    @property
    def plain(self) -> bool:
        """True if noise is assumed to be white, and the gripper to be known exactly."""
        return not (self.coloured or self.uncertain)

    def calibrated(self, files: Sequence[Path]) -> "CaseProblem":
        """Take the arms of the first calibration file (YAML), if there is one.

        If it cannot be read, it is a `BiogripError`.
        """
        if not files:
            return self
        gripper, uncertainty = read_calibrated_arms(files[0], self.gripper)
        return replace(self, gripper=gripper, uncertainty={**self.uncertainty, **uncertainty})

    def of(
        self,
        time_s: Array,
        readings: Array,
        model: SampleModel | None = None,
        noise_sd: float | None = None,
        condensed: Condensed | None = None,
    ) -> Problem:
        """Pose the problem of a trace, (n_samples,), times ascending.

        `model`, `noise_sd`, and `condensed` from `in_noise` replace those of the case.
        """
        rows = condensed or self._condensed(time_s)
        trace = Trace(time_s, readings, rows, noise_sd or self.noise_sd)
        given = self.gripper, model or self.searched, self.torque, trace
        return make_problem(Residuals(*given, instrument=self.instrument), self.ranges)

    def _condensed(self, time_s: Array) -> Condensed:
        """Return rows for times, weighted if `sd` is known; those in use, if there are any."""
        sd = None if self.sd is None else self.sd.tobytes()
        held = self.phases, self.instrument, self.offset, self.drift
        key = *held, sd, time_s.tobytes()
        if (rows := _IN_USE.get(key)) is None:
            rows = self.in_noise(time_s, None, np.zeros((0, len(time_s))))
            _IN_USE[key] = rows
        return rows

    def for_model(self, problem: Problem, model: SampleModel) -> Problem:
        """Return one of its problems posed for another model; both share rows of the trace."""
        return make_problem(problem.residuals.of_model(model), self.ranges)

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

        Noise without a model is white. Uncertain are functions added with a random amplitude, see
        `with_uncertain`; noise may grow with a rotation, see `Whitening`: (n_functions, n_samples)
        and (n_samples,).
        """
        nuisance, whitening = self.nuisance(time_s), None
        if noise_model is None and self.sd is not None:
            noise_model, growing = WEIGHTED, self.sd
        if noise_model is not None:
            whitening = Whitening(time_s, noise_model, nuisance, uncertain, growing)
        basis = with_uncertain(nuisance, uncertain)
        return Condensed(self.torque, time_s, basis, whitening=whitening)

    def logs(self, parameters: Mapping[str, float]) -> Array:
        """Return log-parameters of the searched parameters, zeros replaced by the lower bound."""
        chosen = [(parameters[p.name], self.ranges[p.range_name]) for p in self.searched.parameters]
        return np.log([max(value, genes.low) for value, genes in chosen])
