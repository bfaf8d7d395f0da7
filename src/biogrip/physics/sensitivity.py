"""Rotation and its exact derivatives by the logarithms of the sample's parameters.

Modes with their derivatives (`biogrip.physics.modes`), without the arms' inertia, are superposed
in time by analytic formulas. Only the correction of the nonlinear model, a small term, has finite
differences as derivatives.
"""

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import compute_protocol_modes, compute_responses
from biogrip.physics.nonlinear import COARSE, Correction, correction
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import SampleModel

# The correction is of second order; differences give its derivative to 1e-6 of that.
_STEP = 1e-3
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
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    nonlinear: bool = False,
) -> tuple[Array, Array]:
    """Compute the rotation of the left arm without inertia, and its derivatives d phi / d log p.

    By the nonlinear model or the linear one; all of the sample's parameters are positive.

    Returns
    -------
    rotation : (n_times,)
        In rad; NaN where the nonlinear model has no response.
    sensitivity : (n_parameters, n_times)
        In rad.
    """
    rows = rotations_and_sensitivities(
        gripper, model, torque, time_s, parameters[None], nonlinear=nonlinear
    )[0]
    return rows[0], rows[1:]


def rotations_and_sensitivities(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    nonlinear: bool,
) -> Array:
    """Compute what `rotation_and_sensitivity` does for many samples, (n, n_parameters).

    First the rotation in rad, then its derivatives: (n, 1 + n_parameters, n_times).
    """
    rows = linear_responses(gripper, model, torque, time_s, parameters)
    if nonlinear:
        found = corrections(gripper, model, torque, parameters)
        values = np.where(found.converged[:, None], found.at(time_s), np.nan)
        added = differences(values.reshape(len(parameters), -1, len(time_s)))
        added[:, 1:] = np.nan_to_num(added[:, 1:])
        rows += added
    return rows


def corrections(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Correction:
    """Compute nonlinear minus linear rotation of samples and of slightly changed samples.

    Arguments are those of `linear_responses`. It is that of n (1 + 2 n_parameters) samples, see
    `differences`; without `slopes`, of n.
    """
    around = _around(parameters, slopes=slopes)
    return correction(gripper, model.network(around), torque, COARSE)


def differences(values: Array) -> Array:
    """Turn values of `corrections`, (n, 1 + 2 n_parameters, ...), into values and derivatives.

    The derivatives are central differences in the log-parameters: (n, 1 + n_parameters, ...).
    """
    slopes = (values[:, 1::2] - values[:, 2::2]) / (2 * _STEP)
    return np.concatenate((values[:, :1], slopes), axis=1)


def _around(parameters: Array, *, slopes: bool) -> Array:
    """Return each sample and, for slopes, copies with each parameter in turn changed by a step."""
    count = parameters.shape[1]
    steps = np.zeros((1, count))
    if slopes:
        unit = np.eye(count)
        both_ways = np.stack((unit, -unit), axis=1).reshape(-1, count)
        steps = _STEP * np.concatenate((steps, both_ways))
    return (parameters[:, None] * np.exp(steps)).reshape(-1, count)
