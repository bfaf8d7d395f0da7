"""Experiment plan from the best torque: values that can be set, and readings in bursts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.bursts import make_bursts, whole
from biogrip.design.experiment import DesignInputs, compute_information
from biogrip.design.few_bins import in_few_bins
from biogrip.design.sampling import best_sampling
from biogrip.design.search import Torque
from biogrip.design.set_values import set_values
from biogrip.design.time_bins import TimeBins, periodic_time_bins, time_bins
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import Network
from biogrip.experiment.sampling import Burst, Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.response.jaw_force import jaw_force

_GROWTH, _GAP, _FILLINGS = 1.12, 0.005, 200
# Under sinusoids: parts of a period, and growth of the number of periods of a cell.
_PARTS, _PERIODS = 24, 1.4
# Instants after a step at which the force is computed, and rounding relative to the largest.
_INSTANTS, _EARLIEST_S, _NOTHING = 400, 1e-8, 1e-9
# Instants in a period, and growth of the distance between periods at which it is computed.
_OF_A_PERIOD, _FURTHER = 64, 1.3


@dataclass(frozen=True)
class Plan:
    """A designed experiment: protocol and sampling, with their information."""

    phases: tuple[Phase, ...]
    """Torques of both arms."""
    bursts: tuple[Burst, ...]
    """Sampling times of the rotation."""
    information: Array
    """Fisher information of the log-parameters of the plausible samples, including that of earlier
    experiments, (n, n_parameters, n_parameters)."""
    gap: float
    """Share by which the typical relative bound may exceed that of the best sampling of this
    torque."""

    @property
    def torque(self) -> TorqueHistory:
        """Torque of both arms against time."""
        return torque_history(self.phases)

    @property
    def time_s(self) -> Array:
        """Sampling times of the rotation, (n_samples,)."""
        return Sampling(bursts=self.bursts).over(self.torque.end_s)


@dataclass(frozen=True)
class SamplingProblem:
    """Cells of time of an experiment, over which readings are to be distributed."""

    each: tuple[TimeBins, ...]
    """Cells after each step."""
    starts: IntArray
    """Slots at which steps begin, (n_steps,)."""
    sensitivity: Array
    """Sensitivities to the log-parameters in units of the noise, (n, n_parameters, n_cells)."""
    capacity: Array
    """Largest number of readings in each cell, (n_cells,)."""


def planned(inputs: DesignInputs, torques: Sequence[Torque]) -> Plan:
    """Find the best sampling of the first torque with which the jaws press throughout.

    The torques are those of `best_torques`, which checks contact at fewer instants.

    Raises
    ------
    BiogripError
        If with all of them the jaws would have to pull.
    """
    for torque in torques:
        phases = set_values(inputs, torque)
        if presses(inputs, phases):
            return _sampled(inputs, phases)
    raise BiogripError(
        "design: with all torques that were found the jaws would have to pull at some instant; "
        "allowed are more torques to be tried (`candidates`)."
    )


def presses(inputs: DesignInputs, phases: Sequence[Phase]) -> bool:
    """Return True if the jaws, if any, press all plausible samples at all instants checked."""
    if not inputs.instrument.has_jaws:
        return True
    network = inputs.model.network(inputs.parameters)
    _, force = forces(inputs.gripper, network, phases)
    return bool(np.all(force.min(axis=1) >= -_NOTHING * force.max(axis=1)))


def sampling_problem(inputs: DesignInputs, phases: tuple[Phase, ...]) -> SamplingProblem:
    """Divide the time of an experiment into cells, and compute the sensitivities there."""
    slots = [round(phase.duration_s * inputs.fastest_Hz) for phase in phases]
    each = tuple(
        _time_bins(count, phase, inputs.fastest_Hz)
        for count, phase in zip(slots, phases, strict=True)
    )
    starts = np.cumsum([0, *slots[:-1]])
    middle = np.concatenate([start + own.middle for start, own in zip(starts, each, strict=True)])
    order = np.argsort(middle, kind="stable")
    sensitivity = np.empty((*inputs.parameters.shape, len(middle)))
    times_s = middle[order] / inputs.fastest_Hz
    sensitivity[..., order] = inputs.sensitivities(inputs.history(phases), times_s)
    capacity = np.concatenate([own.capacity for own in each]).astype(float)
    return SamplingProblem(each, starts, sensitivity, capacity)


def _time_bins(slots: int, phase: Phase, fastest_Hz: float) -> TimeBins:
    for harmonic in phase.left.harmonics:
        return periodic_time_bins(
            slots, round(fastest_Hz / harmonic.frequency_Hz), _PARTS, _PERIODS
        )
    return time_bins(slots, _GROWTH)


def _sampled(inputs: DesignInputs, phases: tuple[Phase, ...]) -> Plan:
    problem = sampling_problem(inputs, phases)
    sensitivity, capacity = problem.sensitivity, problem.capacity
    best = best_sampling(
        sensitivity,
        capacity,
        inputs.samples,
        inputs.criterion,
        gap=_GAP,
        most=_FILLINGS,
        before=inputs.before,
    )
    few = in_few_bins(sensitivity, best.samples, capacity, _late(problem.each), inputs.before)
    counts = whole(few, capacity)
    bursts = make_bursts(problem.each, problem.starts, counts, inputs.fastest_Hz)
    history = inputs.history(phases)
    rows = inputs.sensitivities(history, Sampling(bursts=bursts).over(history.end_s))
    information = compute_information(rows) + inputs.before
    return Plan(phases, bursts, information, best.gap)


def forces(gripper: Gripper, network: Network, phases: Sequence[Phase]) -> tuple[Array, Array]:
    """Compute times in s, (n_times,), dense after each step, and jaw forces in N, (n, n_times).

    With inertia.
    """
    history = torque_history(tuple(phases))
    lengths = np.diff(np.append(history.time_s, history.end_s))
    after = np.geomspace(_EARLIEST_S, lengths, _INSTANTS, axis=1)
    # At the very end of a step the next begins.
    after[:, -1] *= 1 - 1e-9
    instants = [(history.time_s[:, None] + after).ravel()]
    for start_s, phase in zip(history.time_s, phases, strict=True):
        for harmonic in phase.left.harmonics:
            period_s = 2 * np.pi / harmonic.omega_rad_per_s
            instants.append(start_s + _swings(period_s, phase.duration_s))
    time_s = np.unique(np.concatenate(instants))
    return time_s, jaw_force(gripper, network, history, time_s, nonlinear=False)


def _swings(period_s: float, duration_s: float) -> Array:
    """Return instants dense in some periods, at growing distances, and in the last."""
    count = duration_s / period_s
    begins = np.unique(np.floor(_FURTHER ** np.arange(np.log(count + 1) / np.log(_FURTHER))) - 1)
    begins = np.append(begins, count - 1)
    instants = begins[:, None] + np.arange(_OF_A_PERIOD) / _OF_A_PERIOD
    inside: Array = instants[(instants > 0) & (instants < count * (1 - 1e-9))]
    return period_s * inside


def _late(each: Sequence[TimeBins]) -> Array:
    """Return the relative positions of cells within their steps, from 0 to 1."""
    return np.concatenate([np.arange(len(own.first)) / len(own.first) for own in each])
