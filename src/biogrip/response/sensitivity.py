"""Rotation and its exact derivatives by the logarithms of the sample's parameters.

Modes with their derivatives (`biogrip.response.modes`, with inertia
`biogrip.response.ringing`) are superposed in time by analytic formulas. Only small terms have
finite differences as derivatives: the correction of the nonlinear model, and the ringing of
arms on a springpot.
"""

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.inertia import ring, while_ringing
from biogrip.response.nonlinear import COARSE, Correction, correction
from biogrip.response.protocol_modes import compute_protocol_modes
from biogrip.response.ringing import compute_responses, ringing_responses

# The correction is of second order; differences give its derivative to 1e-6 of that.
_STEP = 1e-3
# Ringing runs through hundreds of radians before it ends: its differences need a shorter step. On
# a sample that is elastic at once, which damps it least, it runs through thousands.
_RINGING_STEP, _ELASTIC_STEP = 1e-5, 2e-6
# Times at once: the responses of modes at a million times would take too much memory.
_AT_ONCE = 100_000


def linear_responses(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    inertia: bool,
    slopes: bool = True,
) -> Array:
    """Compute rotations of the left arm in the linear model, and derivatives d phi / d log p.

    Arguments and result are those of `ringing_responses`; `inertia` is True to include the
    inertia of the arms.
    """
    if inertia and not model.power_law:
        return ringing_responses(gripper, model, torque, time_s, parameters, slopes=slopes)
    modes = compute_protocol_modes(gripper, model, torque, parameters, slopes=slopes)
    rows = np.empty((len(parameters), 1 + modes.rate_slopes.shape[1], len(time_s)))
    for some in parts(len(time_s), _AT_ONCE):
        rows[:, :, some] = compute_responses(modes, torque, time_s[some])
    if inertia and np.any(ringing := while_ringing(gripper, torque, time_s)):
        elastic = not np.any(model.network(parameters[:1]).c_p)
        step = _ELASTIC_STEP if elastic else _RINGING_STEP
        around = model.network(_around(parameters, step, slopes=slopes))
        added = ring(gripper, around, torque, time_s[ringing])
        added = added.reshape(len(parameters), -1, added.shape[1])
        rows[..., ringing] += differences(added, step)
    return rows


def rotation_and_sensitivity(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    nonlinear: bool = False,
    inertia: bool = False,
) -> tuple[Array, Array]:
    """Compute the rotation of the left arm, and its derivatives d phi / d log p.

    By either model, as in `simulated_rotation`; all of the sample's parameters are positive.

    Returns
    -------
    rotation : (n_times,)
        In rad; NaN where the nonlinear model has no response.
    sensitivity : (n_parameters, n_times)
        In rad.
    """
    rows = rotations_and_sensitivities(
        gripper, model, torque, time_s, parameters[None], nonlinear=nonlinear, inertia=inertia
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
    inertia: bool,
) -> Array:
    """Compute what `rotation_and_sensitivity` does for many samples, (n, n_parameters).

    First the rotation in rad, then its derivatives: (n, 1 + n_parameters, n_times).
    """
    rows = linear_responses(gripper, model, torque, time_s, parameters, inertia=inertia)
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

    Arguments are those of `ringing_responses`. It is that of n (1 + 2 n_parameters) samples, see
    `differences`; without `slopes`, of n.
    """
    around = _around(parameters, _STEP, slopes=slopes)
    return correction(gripper, model.network(around), torque, COARSE)


def differences(values: Array, step: float = _STEP) -> Array:
    """Turn values of `corrections`, (n, 1 + 2 n_parameters, ...), into values and derivatives.

    The derivatives are central differences with `step` in the log-parameters:
    (n, 1 + n_parameters, ...).
    """
    slopes = (values[:, 1::2] - values[:, 2::2]) / (2 * step)
    return np.concatenate((values[:, :1], slopes), axis=1)


def _around(parameters: Array, step: float, *, slopes: bool) -> Array:
    """Return each sample and, for slopes, copies with each parameter in turn changed by a step."""
    count = parameters.shape[1]
    steps = np.zeros((1, count))
    if slopes:
        unit = np.eye(count)
        both_ways = np.stack((unit, -unit), axis=1).reshape(-1, count)
        steps = step * np.concatenate((steps, both_ways))
    return (parameters[:, None] * np.exp(steps)).reshape(-1, count)
