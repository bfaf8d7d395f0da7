"""Simulated rotation and shortening of samples, by the linear or the nonlinear model.

Targets have the arms' inertia, fits leave it out: after a change of the torque, arms ring for
milliseconds, and later changes by inertia are negligible (docs/model.md, "Without inertia"). What
of the ring shows in a trace is found here, too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper, displacement_of_tip
from biogrip.physics.linear import LEFT, RIGHT, rotation, step_response
from biogrip.physics.modes import relaxation
from biogrip.physics.nonlinear import nonlinear_rotation
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import Network


def simulated_rotation(
    gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array, *, nonlinear: bool
) -> Array:
    """Simulate the closing rotation of the left arm in rad, with inertia, (n, n_times).

    By the nonlinear model, corrected eqs. (1)-(3), which has the errors of `nonlinear_rotation`,
    or the linear one, (4)-(6), at ascending times.
    """
    if nonlinear:
        return nonlinear_rotation(gripper, network, torque, time_s)
    if torque.deforms:
        return relaxation(network, torque, time_s)
    response = step_response(
        gripper, network, symmetric=torque.symmetric, inertia=gripper.has_inertia
    )
    return rotation(response, torque, time_s)


def simulated_shortening(
    gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array, *, nonlinear: bool
) -> Array:
    """Simulate the shortening of samples in m, (n, n_times); see `simulated_rotation`."""
    if nonlinear:
        turns = (nonlinear_rotation(gripper, network, torque, time_s, a) for a in (LEFT, RIGHT))
        left, right = (displacement_of_tip(gripper, turn) for turn in turns)
        return left + right
    response = step_response(gripper, network, symmetric=torque.symmetric)
    both = rotation(response, torque, time_s, LEFT) + rotation(response, torque, time_s, RIGHT)
    return gripper.lever_m * both


# A ring of exp(-36) is lost in rounding.
_DECAYED = 36.0

VISIBLE = 0.2
"""Norm of a ring in standard deviations of the noise from which it counts as visible.

No estimate is off by more of its standard deviations: a 95 % interval then holds the truth in 94.5
% or more of traces.
"""


@dataclass(frozen=True)
class Ring:
    """Ringing of the arms that shows in a trace."""

    largest: float
    """Largest change of a reading by inertia, in standard deviations of the noise."""
    lasts_s: float
    """Time after a change of the torque of the last reading that would have to be left out."""


def find_ring(
    gripper: Gripper,
    network: Network,
    torque: TorqueHistory,
    time_s: Array,
    in_noise: Callable[[Array], Array],
) -> Ring | None:
    """Return what shows of the ringing of arms on the first sample, or None.

    A parallel damper ends a ring. It only counts if it is seen when the ring is over, too: what
    readings of a ring tell of it, without inertia, is the ring's.

    Parameters
    ----------
    gripper, network, torque
        Arms, sample and protocol.
    time_s : (n_samples,)
        Sampling times.
    in_noise
        Turns a change of the readings, (n_samples,), into standard deviations of white noise.
    """
    if not gripper.has_inertia:
        return None
    springs = network.k_p + network.k.sum(axis=1) + gripper.jaw_stiffness_N_per_m
    is_seen = network.c_p > ringing_s(gripper) * springs
    network = replace(network, c_p=np.where(is_seen, network.c_p, 0.0))
    elapsed = elapsed_s(torque, time_s)
    ringing = elapsed <= ringing_s(gripper)
    change = np.zeros(len(time_s))
    change[ringing] = ring(gripper, network, torque, time_s[ringing])[0]
    shown = in_noise(change)
    latest_first = np.argsort(-elapsed, kind="stable")
    norms = np.sqrt(np.cumsum(shown[latest_first] ** 2))
    visible = np.flatnonzero(norms > VISIBLE)
    if not len(visible):
        return None
    return Ring(float(np.max(np.abs(shown))), float(elapsed[latest_first[visible[0]]]))


def ringing_s(gripper: Gripper) -> float:
    """Return the time in s after which the ringing of the arms has decayed below rounding.

    An arm loses energy to its own damper, whatever else it moves: the envelope of its ringing
    falls at least like exp(-c t / (2 I)).
    """
    arms = gripper.left, gripper.right
    return _DECAYED * max(2 * arm.inertia_kgm2 / arm.damping_Nms_per_rad for arm in arms)


def elapsed_s(torque: TorqueHistory, time_s: Array) -> Array:
    """Return the times since the last change of the torque, (n_times,)."""
    changes_s = np.unique([start for start, *_ in (*torque.jumps, *torque.swings)])
    last = np.maximum(changes_s.searchsorted(time_s, side="right") - 1, 0)
    return time_s - changes_s[last]


def ring(gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute the change of the left arm's rotation by inertia, (n, n_times) in rad."""
    responses = (
        step_response(gripper, network, symmetric=torque.symmetric, inertia=inertia)
        for inertia in (True, False)
    )
    with_it, without = (rotation(response, torque, time_s) for response in responses)
    return with_it - without
