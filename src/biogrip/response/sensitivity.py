"""How the rotation changes with the sample's parameters: exact derivatives, no differences.

Modes with their derivatives (`biogrip.response.modes`, with inertia
`biogrip.response.ringing`) are superposed in time, and differentiated by hand there, too.
"""

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.mode_growth import responses_of_modes
from biogrip.response.modes import Modes, modes_of
from biogrip.response.nonlinear import COARSE, Correction, correction
from biogrip.response.ringing import ringing_responses

# The correction is of second order itself; its derivative by differences is good to 1e-6 of that.
_STEP = 1e-3
# Samples at a time: of a million, what the modes do would take more memory than all else.
_AT_ONCE = 100_000


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
    """Rotation of the left arm, and its derivatives d phi / d log p.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    time_s : (n_times,)
        Ascending times.
    parameters : (n_parameters,)
        All positive.
    nonlinear
        Whether to add what corrected eqs. (1)-(3) have over the linear model.
    inertia
        Whether the arms ring, for milliseconds after every change of the torque.

    Returns
    -------
    rotation : (n_times,)
        In rad; NaN where the nonlinear model has no answer.
    sensitivity : (n_parameters, n_times)
        In rad.
    """
    if inertia:
        rows = ringing_responses(gripper, model, torque, time_s, parameters[None])[0]
        phi, slopes = rows[0], rows[1:]
    else:
        modes = modes_of(gripper, model, parameters[None], symmetric=torque.symmetric)
        rows = np.empty((1 + len(parameters), len(time_s)))
        for some in parts(len(time_s), _AT_ONCE):
            rows[:, some] = _mixed(modes, *responses_of_modes(modes.rates[0], torque, time_s[some]))
        phi, slopes = rows[0], rows[1:]
    if nonlinear:
        found = corrections(gripper, model, torque, parameters[None])
        values = np.where(found.converged[:, None], found.at(time_s), np.nan)
        phi = phi + values[0]
        slopes = slopes + np.nan_to_num(differences(values[None])[0, 1:])
    return phi, slopes


def corrections(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Correction:
    """Nonlinear minus linear rotation of samples, and of those that are a little different.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    parameters : (n, n_parameters)
        All positive.
    slopes
        Whether the samples that are a little different are wanted.

    Returns
    -------
    Correction
        Of n (1 + 2 n_parameters) samples, see `differences`; without `slopes`, of n.
    """
    count = parameters.shape[1]
    steps = np.zeros((1, count))
    if slopes:
        steps = _STEP * np.concatenate((steps, _both_ways(count)))
    around = (parameters[:, None] * np.exp(steps)).reshape(-1, count)
    return correction(gripper, model.network(around), torque, COARSE)


def differences(values: Array) -> Array:
    """What `corrections` found, and its derivatives by the log-parameters.

    Parameters
    ----------
    values : (n, 1 + 2 n_parameters, ...)

    Returns
    -------
    (n, 1 + n_parameters, ...)
    """
    slopes = (values[:, 1::2] - values[:, 2::2]) / (2 * _STEP)
    return np.concatenate((values[:, :1], slopes), axis=1)


def _both_ways(count: int) -> Array:
    """Unit steps of each parameter, forward and back in turn."""
    unit = np.eye(count)
    return np.stack((unit, -unit), axis=1).reshape(-1, count)


def _mixed(modes: Modes, growth: Array, slope: Array) -> Array:
    """Weigh what the modes do; d(w g) = dw g + w dr dg/dr."""
    weights, times = modes.weights[0], growth.shape[-1]
    slanted = weights * modes.rate_slopes[0][:, None]
    by_growth = np.concatenate((weights[None], modes.weight_slopes[0]))
    by_slope = np.concatenate((np.zeros_like(weights)[None], slanted))
    both = np.concatenate(
        (by_growth.reshape(len(by_growth), -1), by_slope.reshape(len(by_slope), -1)), axis=1
    )
    rows: Array = both @ np.concatenate((growth, slope)).reshape(-1, times)
    return rows
