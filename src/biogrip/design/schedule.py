"""Experiment plan from the best torque: values that can be set, and readings in bursts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.design.bursts import make_bursts, whole
from biogrip.design.exchange import exchanged
from biogrip.design.experiment import DesignInputs
from biogrip.design.few_bins import in_few_bins
from biogrip.design.rating import Torque
from biogrip.design.sampling import FINE, Optimum, best_sampling, least_bound
from biogrip.design.set_values import set_values
from biogrip.design.spread_readings import CellNoise, spread_readings, whole_along
from biogrip.design.time_bins import TimeBins, periodic_time_bins, time_bins, with_fine_end
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import Network
from biogrip.experiment.sampling import Burst, Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.response.jaw_force import jaw_force

_GROWTH, _RINGING, _GAP, _FILLINGS = 1.03, 1.01, 1e-4, 300
# Shares by which steps are made smaller, until the jaws press at all instants.
_SMALLER = (0.0, 1e-3, 2e-3, 5e-3, 1e-2)
# Torques that are sampled finely, of which the best is taken.
_COMPARED = 2
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
    """Share by which the typical relative bound may exceed that of any sampling of this torque; NaN
    where the noise has memory, for then it is not known."""

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
    """Sensitivities to the log-parameters in units of the noise, and what is fitted along, (n,
    n_parameters + n_functions, n_cells)."""
    capacity: Array
    """Largest number of readings in each cell, (n_cells,)."""
    middle_s: Array
    """Middle of the first repetition of each cell, (n_cells,)."""
    lasting_s: Array
    """Length of each, (n_cells,)."""


def planned(inputs: DesignInputs, torques: Sequence[Torque]) -> Plan:
    """Find the best sampling of the first torques with which the jaws press, and the best of them.

    The torques are sorted, from a search that checks contact at fewer instants, and has fewer cells
    of time.

    Raises
    ------
    BiogripError
        If with all of them the jaws would have to pull.
    """
    found: list[Plan] = []
    for torque in torques:
        if phases := _pressing(inputs, torque):
            found.append(sampled(inputs, phases))
            if len(found) == _COMPARED:
                break
    if found:
        return min(found, key=lambda plan: inputs.typical_bound(plan.information))
    raise BiogripError(
        "design: with all torques that were found the jaws would have to pull at some instant; "
        "allowed are more torques to be tried (`candidates`)."
    )


def _pressing(inputs: DesignInputs, torque: Torque) -> tuple[Phase, ...]:
    """Return what to set, its steps a little smaller where the jaws would pull; else nothing."""
    waveform = torque.waveform
    for smaller in _SMALLER:
        levels, ends = (
            1.0 - (1.0 - smaller) * (1.0 - part) for part in (waveform.levels, waveform.ends)
        )
        phases = set_values(
            inputs, Torque(replace(waveform, levels=levels, ends=ends), torque.largest_Nm)
        )
        if presses(inputs, phases):
            return phases
        if not waveform.only_steps:
            break
    return ()


def presses(inputs: DesignInputs, phases: Sequence[Phase]) -> bool:
    """Return True if the jaws, if any, press all plausible samples at all instants checked."""
    return bool(presses_each(inputs, phases).all())


def presses_each(inputs: DesignInputs, phases: Sequence[Phase]) -> BoolArray:
    """Return True for each plausible sample that the jaws, if any, press so, (n,)."""
    if not inputs.instrument.has_jaws:
        return np.ones(len(inputs.parameters), dtype=bool)
    network = inputs.model.network(inputs.parameters)
    _, force = forces(inputs.gripper, network, phases)
    pressed: BoolArray = force.min(axis=1) >= -_NOTHING * force.max(axis=1)
    return pressed


def sampling_problem(
    inputs: DesignInputs, phases: tuple[Phase, ...], at: str = "middle"
) -> SamplingProblem:
    """Divide the time of an experiment into cells, and compute the sensitivities there.

    They are computed in the `middle` of each cell, or in the slot where it `begins` or `finishes`.
    """
    slots = [round(phase.duration_s * inputs.fastest_Hz) for phase in phases]
    each = tuple(
        _time_bins(count, phase, inputs.fastest_Hz)
        for count, phase in zip(slots, phases, strict=True)
    )
    starts = np.cumsum([0, *slots[:-1]])
    slot = np.concatenate(
        [start + getattr(own, at) for start, own in zip(starts, each, strict=True)]
    )
    order = np.argsort(slot, kind="stable")
    sensitivity = np.empty((*inputs.parameters.shape, len(slot)))
    times_s = slot[order] / inputs.fastest_Hz
    sensitivity[..., order] = inputs.sensitivities(inputs.averaged(phases), times_s)
    along = inputs.along(slot / inputs.fastest_Hz)
    along = np.broadcast_to(along, (len(sensitivity), *along.shape))
    capacity = np.concatenate([own.capacity for own in each]).astype(float)
    lasting = np.concatenate([own.slots for own in each])
    first = np.concatenate([start + own.first for start, own in zip(starts, each, strict=True)])
    return SamplingProblem(
        each,
        starts,
        np.append(sensitivity, along, axis=1),
        capacity,
        (first + (lasting - 1) / 2) / inputs.fastest_Hz,
        lasting / inputs.fastest_Hz,
    )


def _time_bins(slots: int, phase: Phase, fastest_Hz: float) -> TimeBins:
    for harmonic in phase.left.harmonics:
        return periodic_time_bins(
            slots, round(fastest_Hz / harmonic.frequency_Hz), _PARTS, _PERIODS
        )
    return with_fine_end(time_bins(slots, _GROWTH, ringing=_RINGING))


def sampled(inputs: DesignInputs, phases: tuple[Phase, ...]) -> Plan:
    """Find the best sampling of what is held, and round it to readings that can be taken."""
    problem = sampling_problem(inputs, phases)
    best = best_sampling(
        problem.sensitivity,
        problem.capacity,
        inputs.samples,
        inputs.criterion,
        gap=_GAP,
        most=_FILLINGS,
        before=inputs.before_along,
        mixing=FINE,
    )
    plan = _in_bursts(inputs, phases, problem, _in_few(inputs, problem, best.samples))
    if not inputs.noise.has_memory:
        bound = inputs.typical_bound(plan.information)
        return replace(plan, gap=max(bound / _least_bound(inputs, phases, problem, best) - 1, 0.0))
    if any(own.stride for own in problem.each):
        return plan
    spread = _in_bursts(inputs, phases, problem, _spread(inputs, problem))
    return min(plan, spread, key=lambda each: inputs.typical_bound(each.information))


def _in_bursts(
    inputs: DesignInputs, phases: tuple[Phase, ...], problem: SamplingProblem, counts: IntArray
) -> Plan:
    bursts = make_bursts(problem.each, problem.starts, counts, inputs.fastest_Hz)
    history = inputs.averaged(phases)
    return Plan(
        phases,
        bursts,
        inputs.information(history, Sampling(bursts=bursts).over(history.end_s)),
        np.nan,
    )


def _in_few(inputs: DesignInputs, problem: SamplingProblem, samples: Array) -> IntArray:
    """Round a sampling that is best with independent readings, with few bursts."""
    rows, capacity, before = problem.sensitivity, problem.capacity, inputs.before_along
    few = in_few_bins(rows, samples, capacity, _late(problem.each), before)
    return exchanged(rows, whole(few, capacity), few, capacity, inputs.criterion, before)


def _least_bound(
    inputs: DesignInputs, phases: tuple[Phase, ...], problem: SamplingProblem, best: Optimum
) -> float:
    """Return a typical relative bound that no sampling of independent readings falls below."""
    edges = [sampling_problem(inputs, phases, edge).sensitivity for edge in ("begins", "finishes")]
    return least_bound(
        {0.5: [problem.sensitivity], 0.25: edges},
        problem.capacity,
        best.samples,
        inputs.samples,
        inputs.criterion,
        inputs.before_along,
    )


def _spread(inputs: DesignInputs, problem: SamplingProblem) -> IntArray:
    """Return numbers of readings in cells that allow for the noise's memory."""
    noise = CellNoise(problem.middle_s, problem.lasting_s, *inputs.processes)
    return whole_along(
        spread_readings(
            problem.sensitivity,
            noise,
            problem.capacity,
            inputs.samples,
            inputs.criterion,
            inputs.before_along,
        )
    )


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
