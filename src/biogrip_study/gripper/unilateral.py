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

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import phi_functions
from biogrip.physics.protocol import Course
from biogrip.physics.sample_model import Network

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
    """Closing rotations of the left and the right arm in rad, (2, n_times)."""
    jaw_force_N: Array
    """Never negative, (n_times,)."""
    touching: BoolArray
    """True while the jaws touch the sample, (n_times,)."""
    shortening_m: Array
    """Shortening of the sample, (n_times,)."""
    dampers_m: Array
    """Shortening of the damper of each Maxwell branch, (n_branches, n_times)."""
    changes_s: tuple[float, ...]
    """Times at which contact was lost, regained, lost, ..."""


def unilateral_response(
    gripper: Gripper, network: Network, torque: Course, time_s: Array
) -> UnilateralResponse:
    """Simulate the first sample in unilateral contact with the jaws, without inertia.

    Parameters
    ----------
    gripper, network, torque
        Arms, samples of which the first counts, and protocol of both arms.
    time_s
        Ascending, (n_times,); at the instant of a step: what follows it.

    Returns
    -------
    UnilateralResponse
        What is seen at these times.
    """
    state = np.zeros((3 + network.k.shape[1], len(time_s)))
    force_N, touching = np.zeros(len(time_s)), np.zeros(len(time_s), dtype=bool)
    changes_s: list[float] = []
    for stretch in _stretches(gripper, network, torque):
        if stretch.touching != (len(changes_s) % 2 == 0):
            changes_s.append(stretch.begin_s)
        # A reading at its end is also the first of the next, which replaces it.
        here = (time_s >= stretch.begin_s) & (time_s <= stretch.end_s)
        elapsed_s = time_s[here] - stretch.begin_s
        state[:, here], touching[here] = stretch.state(elapsed_s), stretch.touching
        force_N[here] = stretch.touching * np.maximum(stretch.margin(elapsed_s), 0.0)
    return UnilateralResponse(state[:2], force_N, touching, state[2], state[3:], tuple(changes_s))


@dataclass(frozen=True)
class _Stretch:
    """Solution from an instant on, with or without contact, as functions of the time since then."""

    begin_s: float
    end_s: float
    touching: bool
    state: Callable[[Array], Array]
    """phi_2, phi_4, delta and the branches' dampers, (n_states, n_times)."""
    margin: Callable[[Array], Array]
    """Contact force in N, or gap in m, which may not become negative, (n_times,)."""


def _stretches(gripper: Gripper, network: Network, torque: Course) -> Iterator[_Stretch]:
    """Solve phase after phase, each from the state reached on, up to where the margin falls."""
    systems = {contact: _System(gripper, network, touching=contact) for contact in (True, False)}
    least = _least_changes(gripper, torque)
    touching, state = True, np.zeros(3 + network.k.shape[1])
    lengths_s = np.diff(torque.time_s, append=torque.end_s).tolist()
    phases = zip(torque.time_s.tolist(), lengths_s, torque.within_phases, strict=True)
    for start_s, length_s, powers in phases:
        begin_s, in_phase = 0.0, True
        while in_phase:
            system, left_s = systems[touching], length_s - begin_s
            solved, margin = system.solve(state, _after(powers, begin_s))
            lasts_s = _first_below(margin, system.times_within(left_s), least[touching])
            in_phase = lasts_s is not None
            end_s = length_s if lasts_s is None else begin_s + lasts_s
            yield _Stretch(start_s + begin_s, start_s + end_s, touching, solved, margin)
            state = solved(np.array([left_s if lasts_s is None else lasts_s]))[:, 0]
            begin_s, touching = end_s, touching != in_phase


def _least_changes(gripper: Gripper, torque: Course) -> dict[bool, float]:
    """Return the force in N, in contact, and the gap in m, apart, below which is rounding."""
    lengths_s = np.diff(torque.time_s, append=torque.end_s)
    phases = zip(lengths_s, torque.within_phases, strict=True)
    ends = [_loads(powers, np.array([0.0, length_s])) for length_s, powers in phases]
    largest = float(np.max(np.abs(ends)))
    softest = min(arm.stiffness_Nm_per_rad for arm in (gripper.left, gripper.right))
    force, gap = largest / gripper.lever_m, 2 * gripper.lever_m * largest / softest
    return {True: _LEAST_CHANGE * force, False: _LEAST_CHANGE * gap}


def _after(powers: Array, elapsed_s: float) -> Array:
    """Return value, slope and curvature of a load, (3,), counted from a time within a phase."""
    shift = np.array([[1, 0, 0], [elapsed_s, 1, 0], [elapsed_s**2 / 2, elapsed_s, 1]])
    return np.asarray(powers @ shift)


def _loads(powers: Array, elapsed_s: Array) -> Array:
    """Return loads at times, (..., n_times), by value, slope and curvature, (..., 3)."""
    return powers @ np.stack((np.ones_like(elapsed_s), elapsed_s, elapsed_s**2 / 2))


class _System:
    """Equations of motion of gripper and one sample, in contact or apart.

    The state is phi_2, phi_4, delta and the branches' dampers. Apart, all of them are coordinates;
    in contact delta is b (phi_2 + phi_4). L^T is R of a QR decomposition of the dampers' roots.
    """

    def __init__(self, gripper: Gripper, network: Network, *, touching: bool) -> None:
        self._left, self._b, self._touching = gripper.left, gripper.lever_m, touching
        arms = gripper.left, gripper.right
        k_p, c_p, k, c = network.k_p[0], network.c_p[0], network.k[0], network.c[0]
        if not touching:
            # Springs of a sample without a parallel damper are in equilibrium but for so long.
            c_p = c_p or _AT_ONCE_S * (k_p + k.sum())
        springs = np.diag(np.sqrt([*(arm.stiffness_Nm_per_rad for arm in arms), k_p, *k]))
        springs[3:, 2] = -np.sqrt(k)
        dampers = np.diag(np.sqrt([*(arm.damping_Nms_per_rad for arm in arms), c_p, *c]))
        self._whole, self._free = np.eye(len(springs)), [*range(len(springs))]
        if touching:
            self._whole[2, :2] = self._b
            self._free.remove(2)
        self._whole = self._whole[:, self._free]
        _, triangle = np.linalg.qr(dampers @ self._whole)
        self._factor = triangle.T
        self._inverse = np.linalg.inv(self._factor)
        _, sizes, self._turns = np.linalg.svd(springs @ self._whole @ self._inverse.T)
        self._rates = sizes[:, None] ** 2

    def solve(
        self, state: Array, powers: Array
    ) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Return states and margin as functions of time, from a state, (n_states,), on.

        Value, slope and curvature of the torque, (3,), are those of both arms.
        """
        start = (self._turns @ self._factor.T @ state[self._free])[:, None]
        drive = self._turns @ self._inverse @ self._whole[:2].sum(axis=0)[:, None] * powers
        out = self._whole @ self._inverse.T @ self._turns.T

        def modes_at(elapsed_s: Array) -> Array:
            z = -self._rates * elapsed_s
            modes = np.exp(z) * start
            for order in range(3):
                phi = phi_functions(order + 1, z)[-1]
                modes = modes + drive[:, order, None] * elapsed_s ** (order + 1) * phi
            return modes

        def states(elapsed_s: Array) -> Array:
            return out @ modes_at(elapsed_s)

        def margin(elapsed_s: Array) -> Array:
            modes = modes_at(elapsed_s)
            turned, other, shortening = (out @ modes)[:3]
            if not self._touching:
                return shortening - self._b * (turned + other)
            rate = out[0] @ (_loads(drive, elapsed_s) - self._rates * modes)
            arm = self._left
            held = arm.stiffness_Nm_per_rad * turned + arm.damping_Nms_per_rad * rate
            return (_loads(powers, elapsed_s) - held) / self._b

        return states, margin

    def times_within(self, length_s: float) -> Array:
        """Return times from 0 to the end, at growing distances, (n_times,)."""
        first = min(1e-2 / float(self._rates.max()), length_s)
        count = int(np.ceil(np.log(length_s / first) / np.log(_GROWTH_OF_TIMES))) + 1
        return np.append(0.0, np.geomspace(first, length_s, max(count, 2)))


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
