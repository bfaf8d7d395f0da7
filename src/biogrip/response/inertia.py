"""Whether the arms' inertia shows in a trace.

After a change of the torque arms ring, for milliseconds. How much of that a trace shows depends
on when it is sampled, and beside which noise; not on who fits it. A bare spring between the jaws
rings hardest and longest, since dampers only take energy from the ring: while arms ring, what
inertia changes there bounds what it changes elsewhere. What it changes later is next to nothing
(docs/model.md, "Without inertia").
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response

# A ring of exp(-36) is lost in rounding.
_DECAYED = 36.0
# Springs over that of the arms: several, since one may ring with zeros at all samples.
_STIFFNESS = np.geomspace(0.1, 1e4, 16)
# Samples at which the size of a rotation is looked at.
_SOME = 500

VISIBLE = 2e-4
"""Share of its standard deviation by which an estimate may move where inertia is left out."""

# Of a peak, a thousandth: traces with less, or none, count as having that much noise.
_FINEST_NOISE = 2.0**-10


def ringing_s(gripper: Gripper) -> float:
    """How long after a change of the torque arms may be seen ringing, in s.

    An arm loses energy to its own damper, whatever else it moves: the envelope of its ring falls
    at least like exp(-c t / (2 I)).
    """
    arms = gripper.left, gripper.right
    return _DECAYED * max(2 * arm.inertia_kgm2 / arm.damping_Nms_per_rad for arm in arms)


def while_ringing(gripper: Gripper, torque: TorqueHistory, time_s: Array) -> BoolArray:
    """Tell at which times, (n_times,), arms may be seen ringing."""
    changes_s = np.unique([start for start, *_ in (*torque.jumps, *torque.swings)])
    last = np.maximum(changes_s.searchsorted(time_s, side="right") - 1, 0)
    ringing: BoolArray = time_s - changes_s[last] <= ringing_s(gripper)
    return ringing


def ring(gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array) -> Array:
    """Return what inertia adds to the left arm's rotation, (n, n_times) in rad, at any times."""
    responses = (
        step_response(gripper, network, symmetric=torque.symmetric, inertia=inertia)
        for inertia in (True, False)
    )
    with_it, without = (rotation(response, torque, time_s) for response in responses)
    return with_it - without


def change_by_inertia(gripper: Gripper, torque: TorqueHistory, time_s: Array) -> float:
    """Norm of what inertia changes in the samples of a rotation, over the rotation's RMS.

    Parameters
    ----------
    gripper, torque
        Arms and protocol.
    time_s : (n_samples,)
        Ascending sampling times.
    """
    seen = time_s[while_ringing(gripper, torque, time_s)]
    if not len(seen):
        return 0.0
    springs = np.append(0.0, _STIFFNESS) * gripper.jaw_stiffness_N_per_m
    none = np.zeros((len(springs), 0))
    network = Network(k_p=springs, c_p=np.zeros_like(springs), k=none, c=none)
    change = np.linalg.norm(ring(gripper, network, torque, seen), axis=1)
    some_s = time_s[np.linspace(0, len(time_s) - 1, min(_SOME, len(time_s))).astype(np.int64)]
    without = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    size = np.sqrt(np.mean(rotation(without, torque, some_s) ** 2, axis=1))
    # Where no torque ever changes, nothing rings.
    return float(np.max(change / size)) if np.all(size > 0) else 0.0


def inertia_shows(change: float, rotation_rad: Array, noise_rad: float) -> bool:
    """Whether a trace of this size, in this noise, shows what `change_by_inertia` found."""
    size = float(np.sqrt(np.mean(np.square(rotation_rad))))
    noise_rad = max(noise_rad, _FINEST_NOISE * float(np.max(np.abs(rotation_rad))))
    return change * size > VISIBLE * noise_rad
