"""Rotation and its exact derivatives by the logarithms of the sample's parameters.

Modes with their derivatives (`biogrip.physics.modes`), without the arms' inertia, are superposed
in time by analytic formulas.
"""

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import compute_protocol_modes, compute_responses
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import SampleModel

# Times at once: the responses of modes at a million times would take too much memory.
_AT_ONCE = 100_000


def linear_responses(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Array:
    """Compute rotations of the left arm in the linear model, and derivatives d phi / d log p.

    Parameters
    ----------
    gripper, model, torque
        Arms, sample model and protocol of the simulation; the linear model (corrected eqs. 4-6).
    time_s : (n_times,)
        Ascending, from 0.
    parameters : (n, n_parameters)
        All positive.
    slopes
        True to compute derivatives.

    Returns
    -------
    (n, 1 + n_parameters, n_times)
        In rad; without `slopes`, (n, 1, n_times).
    """
    modes = compute_protocol_modes(gripper, model, torque, parameters, slopes=slopes)
    rows = np.empty((len(parameters), 1 + modes.rate_slopes.shape[1], len(time_s)))
    for some in parts(len(time_s), _AT_ONCE):
        rows[:, :, some] = compute_responses(modes, torque, time_s[some])
    return rows


def rotation_and_sensitivity(
    gripper: Gripper, model: SampleModel, torque: TorqueHistory, time_s: Array, parameters: Array
) -> tuple[Array, Array]:
    """Compute what `linear_responses` does for one sample, (n_parameters,).

    Returns
    -------
    rotation : (n_times,)
        In rad.
    sensitivity : (n_parameters, n_times)
        In rad.
    """
    rows = linear_responses(gripper, model, torque, time_s, parameters[None])[0]
    return rows[0], rows[1:]
