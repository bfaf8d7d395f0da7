"""What was done with a sample, which all traces of a case share."""

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.problem import GeneRange, TraceProblem, make_problem
from biogrip.fit.trace_noise import WEIGHTED, NoiseModel, whitened_rows
from biogrip.physics.condensed import Condensed
from biogrip.physics.fractional import LONGEST_S, on_clock
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument, in_contact
from biogrip.physics.models import Sample
from biogrip.physics.noise import nuisance_basis, stream
from biogrip.physics.protocol import SWEEP, Course, Phase, follow_rows, join_phases
from biogrip.physics.residuals import CondensedTrace, Residuals
from biogrip.physics.sample_model import SampleModel, with_fixed

# Key of an arm that fits leave out, and its uncertainty with it.
_NOT_FITTED = "inertia_kgm2"
# Degrees of freedom a reading, with which second differences of white noise tell its variance.
_OF_DIFFERENCES = 18 / 35
# Of shorter protocols, and of too long ones, power laws have units of time of their own.
_SHORT_S = 1e-3


@dataclass(frozen=True)
class Experiment:
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
    """Standard deviation of the noise as a share of the readings, see `proportional_deviations`."""
    sd: Array | None = field(default=None, compare=False)
    """Standard deviations of the readings of a trace, see `weighted`, (n_samples,)."""
    correlation: Array | None = field(default=None, compare=False)
    """Correlation of the noise of both moduli of a sweep, see `PairWhitening`, (n_frequencies,)."""
    coloured: bool = False
    """True if the noise of a trace may be autocorrelated, see `fit_least_squares`."""
    uncertainty: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Standard uncertainties by part and key: of ``left`` and ``right``, the arms; of the
    ``gripper`` itself; ``share`` of the ``torque``; of the ``steps`` of a record, by their number
    from 0, when each came, in s; and ``share`` of these, by which ``all steps`` come later."""
    fit_start: bool = False
    """True if the time at which the protocol started is fitted along (`judging.onset`)."""
    record: Array | None = field(default=None, compare=False)
    """Times from the start and what was controlled at them, (n, 2), where that was recorded, see
    `biogrip.physics.protocol`; the phases are then a hold as long and as high."""
    tip_power: float | None = None
    """Exponent of the depth of which the record has powers, with their sign before the contact."""
    deeper: float = 0.0
    """By how much a tip is deeper than recorded, in the depth's unit (`in_contact`)."""
    fit_contact: bool = False
    """True if that is fitted along (`biogrip.identify.contact`)."""
    load_errors: Array | None = field(default=None, compare=False)
    """Directions in which a record that was smoothed may be off, (n_directions, n), each as long as
    its standard deviation."""
    undeclared: frozenset[str] = frozenset()
    """Which of ``offset`` and ``drift`` nothing is said of: a noise model brings them along."""
    given_ranges: frozenset[str] = frozenset()
    """Names of the ranges that are kept; for a recorded trace others follow from the trace."""
    start_given: bool = True
    """False if nothing says when the protocol of a recorded trace starts."""
    simulated: bool = False
    """True if traces follow this experiment: neither start, offset, drift nor model are doubted."""
    models: tuple[str, ...] = ()
    """Sample models to compare, as in `CANDIDATES`."""
    usual_models: bool = True
    """True to compare power laws, too, and to spare models that cannot suit the trace better."""
    least_squares: LeastSquaresSettings = field(
        default_factory=lambda: LeastSquaresSettings(candidates=1000, starts=16)
    )
    """Budget of the fits."""
    confidence: float = 0.95
    """Of the limits."""
    name: str = "trace"
    """Name that random numbers go by, with `study_seed`."""
    study_seed: int = 0
    """Seed of all random numbers."""

    @cached_property
    def torque(self) -> Course:
        """Torque of both arms, or what else is held, against time."""
        if self.instrument.sweeps:
            return SWEEP
        if self.record is not None:
            time_s, loads = self.record.T
            if self.tip_power is not None:
                loads = in_contact(loads, self.tip_power, self.deeper)
            course = follow_rows(time_s, loads, deforms=self.instrument.deforms)
            return replace(course, smoothed=self.load_errors is not None)
        return join_phases(self.phases, deforms=self.instrument.deforms)

    @cached_property
    def model(self) -> SampleModel:
        """Sample model."""
        return self.sample.model

    @cached_property
    def searched(self) -> SampleModel:
        """Sample model without the fixed parameters."""
        return with_fixed(on_clock(self.model, self.unit_s), self.fixed)

    @property
    def unit_s(self) -> float:
        """Unit of time in which power laws hold as long as the protocol lasts."""
        lasts = 1.0 if self.instrument.sweeps else sum(phase.duration_s for phase in self.phases)
        return lasts if lasts < _SHORT_S else max(lasts / LONGEST_S, 1.0)

    def without_terms(self, names: Collection[str]) -> "Experiment":
        """Leave out an ``offset``, or a ``drift``, of the instrument."""
        offset, drift = self.offset and "offset" not in names, self.drift and "drift" not in names
        return replace(self, offset=offset, drift=drift)

    def to_identify(self, *others: SampleModel) -> "Experiment":
        """Leave out noise model, gripper uncertainty, and ranges neither it nor `others` use."""
        chosen = {p.range_name for model in (self.model, *others) for p in model.parameters}
        ranges = {name: genes for name, genes in self.ranges.items() if name in chosen}
        exact = replace(self, uncertainty={}, load_errors=None, fit_contact=False)
        return replace(exact, ranges=ranges, coloured=False)

    def weighted(
        self, sd: Array | None, *, known: bool = True, correlation: Array | None = None
    ) -> "Experiment":
        """Divide the readings of a trace by their standard deviations, if these are known.

        The noise becomes white, with their root mean square as its standard deviation, which is not
        `known` if only their ratios are.
        """
        if sd is None:
            return self
        noise_sd = float(np.sqrt(np.mean(sd**2))) if known else None
        return replace(self, sd=sd, correlation=correlation, noise_sd=noise_sd)

    @property
    def offset_and_drift(self) -> int:
        """Number of the instrument's terms that are fitted along."""
        return self.offset + self.drift

    def stream(self, purpose: str, seed: int = 0) -> np.random.Generator:
        """Return the random numbers of a trace for one purpose."""
        return stream(self.study_seed, self.name, seed, purpose)

    @property
    def unknowns(self) -> int:
        """Number of parameters that are fitted to a trace, those of the instrument included."""
        return len(self.searched.names) + self.offset_and_drift + self.fit_start

    @property
    def uncertain(self) -> list[tuple[str, str, float]]:
        """Parts, keys and standard uncertainties that change what a fit simulates."""
        return [
            (part, key, error)
            for part, known in self.uncertainty.items()
            for key, error in known.items()
            if error and key != _NOT_FITTED
        ]

    def with_steps_later(self, later_s: Array) -> "Experiment":
        """Return an experiment whose record's steps come later by some s, (n_steps,)."""
        assert self.record is not None
        record, first = self.record.copy(), np.flatnonzero(np.diff(self.record[:, 0]) == 0)
        record[[first, first + 1], 0] += later_s
        return replace(self, record=record)

    @property
    def plain(self) -> bool:
        """True if noise is assumed to be white, and gripper and protocol to be known exactly."""
        uncertain = self.uncertain or self.fit_contact or self.load_errors is not None
        return not (self.coloured or uncertain)

    def of(
        self,
        time_s: Array,
        readings: Array,
        model: SampleModel | None = None,
        noise_sd: float | None = None,
        condensed: Condensed | None = None,
    ) -> TraceProblem:
        """Pose the problem of a trace, (n_samples,), times ascending.

        `model`, `noise_sd`, and `condensed` from `in_noise` replace those of the case.
        """
        rows = condensed or self.in_noise(time_s)
        neighbours, freedom = None, np.inf
        if self.sd is not None and self.noise_sd is None:
            # Only ratios count: deviations are as neighbours scatter in each half of the readings.
            neighbours = float(np.sqrt(np.mean(self.sd**2)))
            freedom = 0.5 * _OF_DIFFERENCES * len(readings)
        trace = CondensedTrace(readings, rows, noise_sd or self.noise_sd, neighbours)
        given = self.gripper, model or self.searched, self.torque, trace
        posed = Residuals(*given, instrument=self.instrument, freedom=freedom)
        return make_problem(posed, self.ranges)

    def of_each(
        self, time_s: Array, traces: Sequence[Array], model: SampleModel | None = None
    ) -> list[TraceProblem]:
        """Pose the problems of several traces of the same times, which share their rows."""
        rows = self.in_noise(time_s)
        return [self.of(time_s, readings, model, condensed=rows) for readings in traces]

    def rows_key(self, time_s: Array) -> Hashable:
        """Return what the rows of a trace depend on, whose times are (n_samples,)."""
        arrays = self.sd, self.correlation, self.record
        held = self.phases, self.instrument, self.offset, self.drift
        return *held, *(None if of is None else of.tobytes() for of in arrays), time_s.tobytes()

    def for_model(self, problem: TraceProblem, model: SampleModel) -> TraceProblem:
        """Return one of its problems posed for another model; both share rows of the trace."""
        residuals = replace(problem.residuals, model=on_clock(model, self.unit_s))
        return make_problem(residuals, self.ranges)

    def nuisance(self, time_s: Array) -> Array:
        """Return the nuisance functions, offset and drift, (n_functions, n_samples)."""
        return nuisance_basis(time_s, offset=self.offset, drift=self.drift)

    def in_noise(
        self,
        time_s: Array,
        noise_model: NoiseModel | None = None,
        uncertain: Array | None = None,
        *,
        growing: Array | None = None,
    ) -> Condensed:
        """Condense the readings for autocorrelated noise or an uncertain gripper.

        Noise without a model is white, weighted if `sd` is known. Uncertain are functions added
        with a random amplitude, see `with_uncertain`; noise may grow with a rotation, see
        `Whitening`: (n_functions, n_samples) and (n_samples,).
        """
        correlation = None
        if noise_model is None and self.sd is not None:
            noise_model, growing, correlation = WEIGHTED, self.sd, self.correlation
        given = self.torque, time_s, self.nuisance(time_s), noise_model, uncertain
        return whitened_rows(*given, growing, correlation)

    def logs(self, parameters: Mapping[str, float]) -> Array:
        """Return log-parameters of the searched parameters, zeros replaced by the lower bound."""
        chosen = [(parameters[p.name], self.ranges[p.range_name]) for p in self.searched.parameters]
        return np.log([max(value, genes.low) for value, genes in chosen])


def pose(
    experiments: Sequence[Experiment], traces: Sequence[tuple[Array, Array]]
) -> list[TraceProblem]:
    """Pose the problem of each of several traces.

    A trace is its ascending times and readings, (n_samples,), and has an experiment. Traces whose
    experiments and times are alike share rows: they are then fitted together, and rows take as long
    as some fifty responses.
    """
    posed: list[TraceProblem] = []
    rows: dict[Hashable, Condensed] = {}
    for experiment, (time_s, readings) in zip(experiments, traces, strict=True):
        key = experiment.rows_key(time_s)
        posed.append(experiment.of(time_s, readings, condensed=rows.get(key)))
        rows[key] = posed[-1].residuals.trace.condensed
    return posed
