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
_LEAST_SHARE = 1e-11
# Time within which a sample without a parallel damper yields, for what is seen at once.
_AT_ONCE_S = 1e-10
# Growth of the distances in the grid on which the end of a stretch is bracketed.
_GROWTH = 1.1


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

    Times ascend; at the instant of a step: what follows it. If contact is lost too often, it is a
    `BiogripError`.
    """
    system, lengths = _System(gripper, network), np.diff(torque.time_s, append=torque.end_s)
    # Start and length of each phase, and the torques of both arms in it.
    both = [np.stack((powers, powers)) for powers in torque.within_phases]
    pieces = list(zip(torque.time_s.tolist(), lengths.tolist(), both, strict=True))
    most_torque = max(
        float(np.max(np.abs(_loads(torques, np.array([0.0, length])))))
        for _, length, torques in pieces
    )
    softest = min(arm.stiffness_Nm_per_rad for arm in (gripper.left, gripper.right))
    least = {
        True: _LEAST_SHARE * most_torque / gripper.lever_m,
        False: _LEAST_SHARE * 2 * gripper.lever_m * most_torque / softest,
    }
    branches = network.k.shape[1]
    states = np.zeros((3 + branches, len(time_s)))
    force, touches = np.zeros(len(time_s)), np.zeros(len(time_s), dtype=bool)
    touching, state = True, np.zeros(3 + branches)
    parted: list[float] = []
    met: list[float] = []
    for start, length, torques in pieces:
        done = 0.0
        while True:
            go_on = system.in_contact if touching else system.apart
            # The torques, counted from there on.
            shift = np.array([[1, 0, 0], [done, 1, 0], [done**2 / 2, done, 1]])
            stretch = go_on(state, torques @ shift)
            grid = _grid(stretch.fastest_per_s, length - done)
            lasts = _first_below(stretch.margin, grid, least[touching])
            begin, end = start + done, start + (length if lasts is None else done + lasts)
            # A reading at its end is also the first of the next stretch, which takes its place.
            here = (time_s >= begin) & (time_s <= end)
            elapsed = time_s[here] - begin
            if len(elapsed):
                states[:, here] = stretch.state(elapsed)
                touches[here] = touching
                if touching:
                    force[here] = np.maximum(stretch.margin(elapsed), 0.0)
            over = np.array([length - done if lasts is None else lasts])
            state = stretch.state(over)[:, 0]
            if lasts is None:
                break
            done += lasts
            (parted if touching else met).append(start + done)
            touching = not touching
            if len(parted) > _MOST_EVENTS:
                raise BiogripError(
                    f"the jaws leave the sample more than {_MOST_EVENTS} times; allowed are "
                    "protocols with fewer phases."
                )
    return UnilateralResponse(
        states[:2], force, touches, states[2], states[3:], tuple(parted), tuple(met)
    )


def _loads(powers: Array, elapsed_s: Array) -> Array:
    """Return loads at times, (n_loads, n_times), by value, slope and curvature, (n_loads, 3)."""
    return powers @ np.stack((np.ones_like(elapsed_s), elapsed_s, elapsed_s**2 / 2))


class _Modes:
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
        self._touching = _Modes(
            np.vstack((spring_rows, side, branches)),
            _coupled(self._c, b * b * c_p, np.sqrt(c)),
        )
        self._arms = _Modes(np.diag(np.sqrt(self._k)), np.diag(np.sqrt(self._c)))
        # Springs of a sample without a parallel damper are in equilibrium but for so long.
        c_p = c_p or _AT_ONCE_S * (k_p + k.sum())
        own = np.concatenate(([np.sqrt(k_p)], np.zeros(n)))
        rest = np.sqrt(k)[:, None] * np.hstack((np.ones((n, 1)), -np.eye(n)))
        self._sample = _Modes(np.vstack((own, rest)), np.diag(np.sqrt(np.append(c_p, c))))

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


def _grid(fastest_per_s: float, length_s: float) -> Array:
    """Return times from 0 to the end, at growing distances, (n_times,)."""
    first = min(1e-2 / fastest_per_s, length_s)
    count = int(np.ceil(np.log(length_s / first) / np.log(_GROWTH))) + 1
    growing = first * _GROWTH ** np.arange(count)
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
