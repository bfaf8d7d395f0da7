"""From the best torque to an experiment that can be set: whole readings, in bursts after steps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.cells import Cells, cells
from biogrip.design.experiment import Wanted
from biogrip.design.few_cells import in_few_cells
from biogrip.design.sampling import best_sampling
from biogrip.design.search import Torque
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, TorqueHistory, held, torque_history
from biogrip.experiment.sample import Network
from biogrip.experiment.sampling import Burst, Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.response.jaw_force import jaw_force
from biogrip.response.ringing import ringing_responses

_GROWTH, _GAP, _FILLINGS = 1.12, 0.005, 200
_DIGITS = 4
# Instants after a step at which the force is looked at, and what of the largest is rounding.
_INSTANTS, _EARLIEST_S, _NOTHING = 400, 1e-8, 1e-9


@dataclass(frozen=True)
class Plan:
    """An experiment.

    Parameters
    ----------
    phases
        Torques of both arms.
    bursts
        When the rotation is read.
    information : (n, n_parameters, n_parameters)
        Fisher information of the log-parameters of the plausible samples, with what earlier
        experiments gave.
    gap
        By what share the typical relative bound may exceed that of the best sampling of this
        torque.
    """

    phases: tuple[Phase, ...]
    bursts: tuple[Burst, ...]
    information: Array
    gap: float

    @property
    def torque(self) -> TorqueHistory:
        """Torque of both arms against time."""
        return torque_history(self.phases)

    @property
    def time_s(self) -> Array:
        """When the rotation is read, (n_samples,)."""
        return Sampling(bursts=self.bursts).over(self.torque.end_s)


def planned(wanted: Wanted, torques: Sequence[Torque]) -> Plan:
    """Sample the first torque with which the jaws press throughout, as well as can be.

    Parameters
    ----------
    wanted
        What is to be designed.
    torques
        From `best_torques`, which looked at fewer instants.

    Raises
    ------
    BiogripError
        If with all of them the jaws would have to pull.
    """
    for torque in torques:
        phases, slots = _set(wanted, torque)
        if presses(wanted, torque_history(phases)):
            return _sampled(wanted, phases, slots)
    raise BiogripError(
        "design: with all torques that were found the jaws would have to pull at some instant; "
        "allowed are more torques to be tried (`tried`)."
    )


def _set(wanted: Wanted, torque: Torque) -> tuple[tuple[Phase, ...], IntArray]:
    """Phases as they can be set, and how many slots each has."""
    levels = [_rounded_down(torque.largest_Nm * share) for share in torque.steps.levels]
    slots = np.round(torque.steps.durations_s * wanted.fastest_Hz).astype(np.intp)
    phases = tuple(
        held(int(count) / wanted.fastest_Hz, level)
        for count, level in zip(slots, levels, strict=True)
    )
    return phases, slots


def presses(wanted: Wanted, history: TorqueHistory) -> bool:
    """Whether the jaws press plausible samples at all instants that are looked at."""
    network = wanted.model.network(wanted.parameters)
    _, force = forces(wanted.gripper, network, history)
    return bool(np.all(force.min(axis=1) >= -_NOTHING * force.max(axis=1)))


def _sampled(wanted: Wanted, phases: tuple[Phase, ...], slots: IntArray) -> Plan:
    history = torque_history(phases)
    each = [cells(int(count), _GROWTH) for count in slots]
    starts = np.concatenate(([0], np.cumsum(slots)[:-1]))
    middle = np.concatenate([start + own.middle for start, own in zip(starts, each, strict=True)])
    capacity = np.concatenate([own.slots for own in each]).astype(float)
    told = _told(wanted, history, middle / wanted.fastest_Hz)
    best = best_sampling(
        told,
        capacity,
        wanted.samples,
        wanted.criterion,
        gap=_GAP,
        most=_FILLINGS,
        before=wanted.before,
    )
    few = in_few_cells(told, best.samples, capacity, _late(each), wanted.before)
    counts = _whole(few, capacity)
    bursts = _bursts(wanted, starts, each, counts)
    seen = _told(wanted, history, Sampling(bursts=bursts).over(history.end_s))
    return Plan(phases, bursts, seen @ seen.swapaxes(1, 2) + wanted.before, best.gap)


def forces(gripper: Gripper, network: Network, history: TorqueHistory) -> tuple[Array, Array]:
    """Jaw force of samples, with inertia, at instants dense after each step.

    Returns
    -------
    time_s : (n_times,)
        In s.
    force : (n, n_times)
        In N.
    """
    lengths = np.diff(np.append(history.time_s, history.end_s))
    after = np.geomspace(_EARLIEST_S, lengths, _INSTANTS, axis=1)
    # At the very end of a step the next begins.
    after[:, -1] *= 1 - 1e-9
    time_s = np.unique(history.time_s[:, None] + after)
    return time_s, jaw_force(gripper, network, history, time_s, nonlinear=False)


def _late(each: list[Cells]) -> Array:
    """How late after their steps cells are, from 0 to 1."""
    return np.concatenate([np.arange(len(own.first)) / len(own.first) for own in each])


def _told(wanted: Wanted, history: TorqueHistory, time_s: Array) -> Array:
    rows = ringing_responses(wanted.gripper, wanted.model, history, time_s, wanted.parameters)
    return rows[:, 1:] / wanted.noise_rad


def _rounded_down(value: float) -> float:
    """So many digits of a torque, which must not become larger."""
    if value <= 0:
        return 0.0
    exponent = int(np.floor(np.log10(value))) - _DIGITS + 1
    return float(f"{np.floor(value / 10.0**exponent * (1 + 1e-12)):.0f}e{exponent}")


def _whole(samples: Array, capacity: Array) -> IntArray:
    """Round numbers of samples, so that their sum stays."""
    counts = np.floor(samples + 1e-9)
    missing = round(float(samples.sum() - counts.sum()))
    room = counts < capacity
    order = np.argsort(-np.where(room, samples - counts, -1.0), kind="stable")
    counts[order[:missing]] += 1
    whole: IntArray = counts.astype(np.intp)
    return whole


def _bursts(
    wanted: Wanted, starts: IntArray, each: list[Cells], counts: IntArray
) -> tuple[Burst, ...]:
    """Bursts of cells; those that are full and follow one another are one."""
    runs: list[list[int]] = []
    place = 0
    for start, own in zip(starts.tolist(), each, strict=True):
        here = counts[place : place + len(own.first)]
        place += len(own.first)
        for first, slots, count in zip(own.first, own.slots, here, strict=True):
            if count == 0:
                continue
            stride = int(slots) // int(count)
            begins = start + int(first) + (int(slots) - 1 - stride * (int(count) - 1)) // 2
            last = runs[-1] if runs else None
            if last and last[1] == stride and begins == last[0] + stride * last[2]:
                last[2] += int(count)
            else:
                runs.append([begins, stride, int(count)])
    rate = wanted.fastest_Hz
    return tuple(Burst(begins / rate, rate / stride, count) for begins, stride, count in runs)
