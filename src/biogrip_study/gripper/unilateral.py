"""The linear model with unilateral contact: jaws press but do not pull, and may lose contact.

While the jaws touch, arms and sample are one system without inertia. When the contact force reaches
zero, each arm turns against its own hinge, and the unloaded sample recovers, until the gap closes.
Every stretch is solved exactly; only the instants at which it ends are found numerically. States
are continuous. Loss and contact do not alternate at once: the force that contact would give and the
rate at which the gap would open are proportional, with opposite signs. The sample may shift between
the jaws freely, so that only the sum of both tips' displacements counts.

Springs and dampers M z' + K z = f with M = L L^T and K = G^T G, one row of G a spring, have the
modes q = V^T L^T z of the singular value decomposition G L^-T = U S V^T, and the rates S^2: twice
as many digits of the slow rates as by the eigenvalues of its square.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, BoolArray
from biogrip.errors import BiogripError
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.response import phi_functions
from biogrip.physics.sample_model import Network

_MOST_EVENTS = 100_000
# Share of the largest force and closing below which a change of contact is rounding.
_LEAST_CHANGE = 1e-11
# Time within which a sample without a parallel damper yields, for what is seen at once.
_AT_ONCE_S = 1e-10
# Growth of the distances in the grid on which the end of a stretch is bracketed.
_GROWTH_OF_TIMES = 1.1


@dataclass(frozen=True)
class UnilateralResponse:
    """Response of gripper and sample with unilateral contact."""

    rotation: Array
    """Closing rotations of the left and the right arm, (2, n_times)."""
    jaw_force_N: Array
    """Never negative, (n_times,)."""
    touching: BoolArray
    """True while the jaws touch the sample, (n_times,)."""
    shortening_m: Array
    """Shortening of the sample, (n_times,)."""
    dampers_m: Array
    """Shortening of the damper of each Maxwell branch, (n_branches, n_times)."""
    parted_s: tuple[float, ...]
    """Times at which contact was lost."""
    met_s: tuple[float, ...]
    """Times at which contact was regained."""


def unilateral_response(
    gripper: Gripper, network: Network, torque: Course, time_s: Array
) -> UnilateralResponse:
    """Simulate the first sample in unilateral contact with the jaws, without inertia.

    Phase after phase: solve from the state reached on; find when the margin falls below zero; read
    the solution up to there; go on from there, with or without contact.

    Parameters
    ----------
    gripper, network, torque
        Arms, samples of which the first counts, and protocol of both arms.
    time_s
        Ascending, (n_times,); at the instant of a step: what follows it.

    Raises
    ------
    BiogripError
        If contact is lost too often.
    """
    system, readings = _System(gripper, network), _Readings(time_s, 3 + network.k.shape[1])
    least = _least_changes(gripper, torque)
    touching, state = True, np.zeros(3 + network.k.shape[1])
    changes_s: dict[bool, list[float]] = {True: [], False: []}
    lengths_s = np.diff(torque.time_s, append=torque.end_s).tolist()
    phases = zip(torque.time_s.tolist(), lengths_s, torque.within_phases, strict=True)
    for start_s, length_s, powers in phases:
        begin_s, in_phase = 0.0, True
        while in_phase:
            solve = system.in_contact if touching else system.apart
            stretch = solve(state, _torques_after(powers, begin_s))
            grid_s = _growing_times(stretch.fastest_per_s, length_s - begin_s)
            lasts_s = _first_below(stretch.margin, grid_s, least[touching])
            end_s = length_s if lasts_s is None else begin_s + lasts_s
            readings.take(stretch, start_s + begin_s, start_s + end_s, touching=touching)
            over_s = length_s - begin_s if lasts_s is None else lasts_s
            state = stretch.state(np.array([over_s]))[:, 0]
            in_phase = lasts_s is not None
            if in_phase:
                begin_s = end_s
                changes_s[touching].append(start_s + begin_s)
                touching = not touching
                _check_events(len(changes_s[True]))
    states, both_s = readings.states, (tuple(changes_s[True]), tuple(changes_s[False]))
    of_sample = states[2], states[3:]
    return UnilateralResponse(states[:2], readings.force_N, readings.touching, *of_sample, *both_s)


class _Readings:
    """What is read at times, (n_times,), stretch by stretch."""

    def __init__(self, time_s: Array, n_states: int) -> None:
        self._time_s = time_s
        self.states = np.zeros((n_states, len(time_s)))
        self.force_N, self.touching = np.zeros(len(time_s)), np.zeros(len(time_s), dtype=bool)

    def take(self, stretch: "_Stretch", begin_s: float, end_s: float, *, touching: bool) -> None:
        """Read a stretch; a reading at its end is also the first of the next, which replaces it."""
        here = (self._time_s >= begin_s) & (self._time_s <= end_s)
        elapsed_s = self._time_s[here] - begin_s
        if not len(elapsed_s):
            return
        self.states[:, here] = stretch.state(elapsed_s)
        self.touching[here] = touching
        if touching:
            self.force_N[here] = np.maximum(stretch.margin(elapsed_s), 0.0)


def _least_changes(gripper: Gripper, torque: Course) -> dict[bool, float]:
    """Return the force in N, in contact, and the gap in m, apart, below which is rounding."""
    lengths_s = np.diff(torque.time_s, append=torque.end_s)
    phases = zip(lengths_s, torque.within_phases, strict=True)
    ends = [_loads(powers, np.array([0.0, length_s])) for length_s, powers in phases]
    largest = float(np.max(np.abs(ends)))
    softest = min(arm.stiffness_Nm_per_rad for arm in (gripper.left, gripper.right))
    force, gap = largest / gripper.lever_m, 2 * gripper.lever_m * largest / softest
    return {True: _LEAST_CHANGE * force, False: _LEAST_CHANGE * gap}


def _torques_after(powers: Array, elapsed_s: float) -> Array:
    """Return both arms' torque, (2, 3) as in `_loads`, counted from a time within a phase."""
    shift = np.array([[1, 0, 0], [elapsed_s, 1, 0], [elapsed_s**2 / 2, elapsed_s, 1]])
    return np.stack((powers, powers)) @ shift


def _check_events(count: int) -> None:
    if count > _MOST_EVENTS:
        raise BiogripError(
            f"the jaws leave the sample more than {_MOST_EVENTS} times; allowed are protocols with "
            "fewer phases."
        )


def _loads(powers: Array, elapsed_s: Array) -> Array:
    """Return loads at times, (n_loads, n_times), by value, slope and curvature, (n_loads, 3)."""
    return powers @ np.stack((np.ones_like(elapsed_s), elapsed_s, elapsed_s**2 / 2))


class _StretchModes:
    """Modes of springs G, (n_springs, n_states), and dampers L, (n_states, n_states), lower."""

    def __init__(self, springs: Array, dampers: Array) -> None:
        inverse = np.linalg.inv(dampers)
        _, sizes, turns = np.linalg.svd(springs @ inverse.T, full_matrices=False)
        self.rates = sizes**2
        self._into = turns @ dampers.T
        self._out = inverse.T @ turns.T
        self._drive = turns @ inverse

    def follow(self, state: Array, powers: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Return states and their rates of change, (n_states, n_times), as a function of time.

        They go on from a state, (n_states,), under loads on the first states, see `_loads`.
        """
        rates, start = self.rates[:, None], (self._into @ state)[:, None]
        powers = self._drive[:, : len(powers)] @ powers

        def motion(elapsed_s: Array) -> tuple[Array, Array]:
            z = -rates * elapsed_s
            modes: NDArray[Any] = np.exp(z) * start
            for order in range(3):
                load = powers[:, order, None]
                if np.any(load):
                    phi = phi_functions(order + 1, z)[-1]
                    modes = modes + load * elapsed_s ** (order + 1) * phi
            return self._out @ modes, self._out @ (_loads(powers, elapsed_s) - rates * modes)

        return motion


class _Stretch(NamedTuple):
    """Solution from an instant on, with or without contact, as functions of the time since then.

    The state, (n, n_times), is phi_2, phi_4, delta and the branches' dampers. The margin, which may
    not become negative, is the contact force or the gap.
    """

    state: Callable[[Array], Array]
    margin: Callable[[Array], Array]
    fastest_per_s: float


class _System:
    """Equations of motion of gripper and one sample, in contact or apart."""

    def __init__(self, gripper: Gripper, network: Network) -> None:
        self._b = b = gripper.lever_m
        arms = gripper.left, gripper.right
        self._c = np.array([arm.damping_Nms_per_rad for arm in arms])
        self._k = np.array([arm.stiffness_Nm_per_rad for arm in arms])
        k_p, c_p, k, c = network.k_p[0], network.c_p[0], network.k[0], network.c[0]
        n = len(k)
        tips = np.array([b, b])
        spring_rows = np.hstack((np.diag(np.sqrt(self._k)), np.zeros((2, n))))
        branches = np.sqrt(k)[:, None] * np.hstack((np.tile(tips, (n, 1)), -np.eye(n)))
        side = np.sqrt(k_p) * np.concatenate((tips, np.zeros(n)))
        self._touching = _StretchModes(
            np.vstack((spring_rows, side, branches)),
            _coupled(self._c, b * b * c_p, np.sqrt(c)),
        )
        self._arms = _StretchModes(np.diag(np.sqrt(self._k)), np.diag(np.sqrt(self._c)))
        # Springs of a sample without a parallel damper are in equilibrium but for so long.
        c_p = c_p or _AT_ONCE_S * (k_p + k.sum())
        parallel = np.concatenate(([np.sqrt(k_p)], np.zeros(n)))
        in_series = np.sqrt(k)[:, None] * np.hstack((np.ones((n, 1)), -np.eye(n)))
        self._sample = _StretchModes(
            np.vstack((parallel, in_series)), np.diag(np.sqrt(np.append(c_p, c)))
        )

    def in_contact(self, state: Array, torques: Array) -> _Stretch:
        """Solve from a state on, in contact."""
        motion = self._touching.follow(np.delete(state, 2), torques)

        def states(elapsed_s: Array) -> Array:
            z, _ = motion(elapsed_s)
            return np.insert(z, 2, self._b * (z[0] + z[1]), axis=0)

        def force(elapsed_s: Array) -> Array:
            (phi, *_), (rate, *_) = motion(elapsed_s)
            held = _loads(torques, elapsed_s)[0] - self._k[0] * phi - self._c[0] * rate
            return held / self._b

        return _Stretch(states, force, float(self._touching.rates.max()))

    def apart(self, state: Array, torques: Array) -> _Stretch:
        """Solve from a state on, without contact."""
        arms = self._arms.follow(state[:2], torques)
        sample = self._sample.follow(state[2:], np.zeros((0, 3)))

        def states(elapsed_s: Array) -> Array:
            return np.vstack((arms(elapsed_s)[0], sample(elapsed_s)[0]))

        def gap(elapsed_s: Array) -> Array:
            z = states(elapsed_s)
            return z[2] - self._b * (z[0] + z[1])

        return _Stretch(states, gap, float(self._arms.rates.max()))


def _coupled(arms: Array, shared: float, diagonal: Array) -> Array:
    """Return the Cholesky factor of diag(c_2, c_4) + w (1, 1)(1, 1)^T, and roots beside it."""
    c_2, c_4 = arms
    first = np.sqrt(c_2 + shared)
    second = np.sqrt(c_4 + shared * c_2 / (c_2 + shared))
    whole = np.diag(np.concatenate(([first, second], diagonal)))
    whole[1, 0] = shared / first
    return whole


def _growing_times(fastest_per_s: float, length_s: float) -> Array:
    """Return times from 0 to the end, at growing distances, (n_times,)."""
    first = min(1e-2 / fastest_per_s, length_s)
    count = int(np.ceil(np.log(length_s / first) / np.log(_GROWTH_OF_TIMES))) + 1
    growing = first * _GROWTH_OF_TIMES ** np.arange(count)
    return np.concatenate(([0.0], growing[growing < length_s], [length_s]), dtype=float)


def _first_below(margin: Callable[[Array], Array], times_s: Array, least: float) -> float | None:
    """Find the first time at which a margin falls to zero and then clearly below."""
    values = margin(times_s)
    below = np.flatnonzero(values < -least)
    if not len(below):
        return None
    after = int(below[0])
    before = max(after - 1, 0)
    if after == 0 or values[before] <= 0:
        return float(times_s[before])
    # Imported here, for only what loses contact needs it.
    from scipy.optimize import brentq

    def at(time_s: float) -> float:
        return float(margin(np.array([time_s]))[0])

    end = brentq(at, times_s[before], times_s[after], xtol=1e-14 * times_s[after])
    return float(end)
