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
from typing import Any

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
    loads_of = (_Forcing(np.stack((powers, powers))) for powers in torque.within_phases)
    pieces = list(zip(torque.time_s.tolist(), lengths.tolist(), loads_of, strict=True))
    most_torque = max(
        float(np.max(np.abs(loads.at(np.array([0.0, length]))))) for _, length, loads in pieces
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
    for start, length, loads in pieces:
        done = 0.0
        while True:
            go_on = system.in_contact if touching else system.apart
            stretch = go_on(state, loads.later(done))
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


@dataclass(frozen=True)
class _Forcing:
    """Loads from an instant on, while the torque is smooth."""

    powers: Array
    """Value, slope and curvature at that instant, (n_loads, 3)."""

    def at(self, elapsed_s: Array) -> Array:
        """Return the loads at times since the instant, (n_loads, n_times)."""
        powers = np.stack((np.ones_like(elapsed_s), elapsed_s, elapsed_s**2 / 2))
        return self.powers @ powers

    def later(self, elapsed_s: float) -> "_Forcing":
        """Return the same loads, counted from a later instant on."""
        t = elapsed_s
        shift = np.array([[1, 0, 0], [t, 1, 0], [t**2 / 2, t, 1]])
        return _Forcing(self.powers @ shift)


class _Modes:
    """Modes of springs G, (n_springs, n_states), and dampers L, (n_states, n_states), lower."""

    def __init__(self, springs: Array, dampers: Array) -> None:
        inverse = np.linalg.inv(dampers)
        _, sizes, turns = np.linalg.svd(springs @ inverse.T, full_matrices=False)
        self.rates = sizes**2
        self._into = turns @ dampers.T
        self._out = inverse.T @ turns.T
        self._drive = turns @ inverse

    def follow(self, state: Array, forcing: _Forcing) -> "_Motion":
        """Return the motion from a state, (n_states,), under loads on the first states."""
        drive = self._drive[:, : len(forcing.powers)]
        return _Motion(
            self.rates[:, None],
            self._out,
            self._into @ state,
            _Forcing(drive @ forcing.powers),
        )


@dataclass(frozen=True)
class _Motion:
    """Motion of a system from an initial state."""

    rates: Array
    """Rates of decay, (n_modes, 1)."""
    shapes: Array
    """States by modes, (n_states, n_modes)."""
    start: Array
    """Initial values of the modes, (n_modes,)."""
    forcing: _Forcing
    """Loads on the modes."""

    def at(self, elapsed_s: Array) -> Array:
        """Return the states at times since the beginning, (n_states, n_times)."""
        return self.shapes @ self._modes(elapsed_s)

    def rate(self, elapsed_s: Array) -> Array:
        """Return the states' rates of change at times since the beginning."""
        loads = self.forcing.at(elapsed_s)
        return self.shapes @ (loads - self.rates * self._modes(elapsed_s))

    def _modes(self, elapsed_s: Array) -> Array:
        z = -self.rates * elapsed_s
        modes: NDArray[Any] = np.exp(z) * self.start[:, None]
        for order in range(3):
            load = self.forcing.powers[:, order, None]
            if np.any(load):
                modes = modes + load * elapsed_s ** (order + 1) * phi_functions(order + 1, z)[-1]
        return modes


@dataclass(frozen=True)
class _Stretch:
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

    def in_contact(self, state: Array, torque: _Forcing) -> _Stretch:
        """Solve from a state on, in contact."""
        motion = self._touching.follow(np.delete(state, 2), torque)

        def states(elapsed_s: Array) -> Array:
            z = motion.at(elapsed_s)
            return np.insert(z, 2, self._b * (z[0] + z[1]), axis=0)

        def force(elapsed_s: Array) -> Array:
            phi, rate = motion.at(elapsed_s)[0], motion.rate(elapsed_s)[0]
            return (torque.at(elapsed_s)[0] - self._k[0] * phi - self._c[0] * rate) / self._b

        return _Stretch(states, force, float(self._touching.rates.max()))

    def apart(self, state: Array, torque: _Forcing) -> _Stretch:
        """Solve from a state on, without contact."""
        arms = self._arms.follow(state[:2], torque)
        sample = self._sample.follow(state[2:], _Forcing(np.zeros((0, 3))))

        def states(elapsed_s: Array) -> Array:
            return np.vstack((arms.at(elapsed_s), sample.at(elapsed_s)))

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
