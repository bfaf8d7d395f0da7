"""Effect of the arms' inertia on a trace, which decides whether fits include inertia.

After a change of the torque, arms ring for milliseconds. The effect on a trace depends on the
sampling times and the noise, not on the fit. It is largest for a bare spring between the jaws,
since dampers take energy from the ring. While arms ring, the change by inertia with a spring
bounds the change with any sample; later changes are negligible (docs/model.md, "Without inertia").
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response

# A ring of exp(-36) is lost in rounding.
_DECAYED = 36.0
# Stiffnesses over that of the arms: several, since one ring may be zero at all readings.
_STIFFNESS = np.geomspace(0.1, 1e4, 16)
# Number of readings from which the size of a rotation is computed.
_SOME = 500

VISIBLE = 2e-4
"""Largest bias of an estimate, in standard deviations, from neglecting inertia."""

# A thousandth of the peak: traces with less noise, or none, count as having that much.
_FINEST_NOISE = 2.0**-10


def ringing_s(gripper: Gripper) -> float:
    """Return the time in s after which the ringing of the arms has decayed below rounding.

    An arm loses energy to its own damper, whatever else it moves: the envelope of its ringing
    falls at least like exp(-c t / (2 I)).
    """
    arms = gripper.left, gripper.right
    return _DECAYED * max(2 * arm.inertia_kgm2 / arm.damping_Nms_per_rad for arm in arms)


def while_ringing(gripper: Gripper, torque: TorqueHistory, time_s: Array) -> BoolArray:
    """Return True for times, (n_times,), at which arms may ring."""
    changes_s = np.unique([start for start, *_ in (*torque.jumps, *torque.swings)])
    last = np.maximum(changes_s.searchsorted(time_s, side="right") - 1, 0)
    return time_s - changes_s[last] <= ringing_s(gripper)


def ring(gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute the change of the left arm's rotation by inertia, (n, n_times) in rad."""
    responses = (
        step_response(gripper, network, symmetric=torque.symmetric, inertia=inertia)
        for inertia in (True, False)
    )
    with_it, without = (rotation(response, torque, time_s) for response in responses)
    return with_it - without


def change_by_inertia(gripper: Gripper, torque: TorqueHistory, time_s: Array) -> float:
    """Compute the norm of the change of a trace by inertia, relative to the rotation's RMS."""
    if not gripper.has_inertia:
        return 0.0
    ringing = time_s[while_ringing(gripper, torque, time_s)]
    if not len(ringing):
        return 0.0
    springs = np.append(0.0, _STIFFNESS) * gripper.jaw_stiffness_N_per_m
    none = np.zeros((len(springs), 0))
    network = Network(k_p=springs, c_p=np.zeros_like(springs), k=none, c=none)
    change = np.linalg.norm(ring(gripper, network, torque, ringing), axis=1)
    some_s = time_s[np.linspace(0, len(time_s) - 1, min(_SOME, len(time_s))).astype(np.int64)]
    without = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    size = np.sqrt(np.mean(rotation(without, torque, some_s) ** 2, axis=1))
    # If the torque never changes, nothing rings.
    return float(np.max(change / size)) if np.all(size > 0) else 0.0


def inertia_shows(change: float, rotation_rad: Array, noise_rad: float) -> bool:
    """Return True if a change from `change_by_inertia` shows in a trace with this noise."""
    size = float(np.sqrt(np.mean(np.square(rotation_rad))))
    noise_rad = max(noise_rad, _FINEST_NOISE * float(np.max(np.abs(rotation_rad))))
    return change * size > VISIBLE * noise_rad
