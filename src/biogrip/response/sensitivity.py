"""How the rotation changes with the sample's parameters: exact derivatives, no differences.

A parameter with a relative imaginary part of 1e-30 carries its derivative through
the arithmetic of the transfer function without touching the real part (complex
step); a pole's derivative is one Newton step of the tilted denominator from the
untilted root. What is left are derivatives of exponentials in time, written out
below, with no cancellation at either end.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory
from biogrip.response.linear import (
    LEFT,
    drives,
    evaluate,
    partial_fractions,
    phi_function,
    poles,
    slope_at_poles,
    transfer_functions,
)
from biogrip.response.nonlinear import COARSE, correction
from biogrip.sample import SampleModel

_TILT = 1e-30
# The correction is of second order itself; its derivative by differences is good to 1e-6 of that.
_STEP = 1e-3


@dataclass(frozen=True)
class Modes:
    """Step response of one sample's left arm, and its derivatives by the log-parameters.

    Parameters
    ----------
    rates : (n_modes,)
        In 1/s, real and negative.
    weights : (n_drives, n_modes)
        In rad per N m.
    rate_slopes : (n_parameters, n_modes)
    weight_slopes : (n_parameters, n_drives, n_modes)
    """

    rates: Array
    weights: Array
    rate_slopes: Array
    weight_slopes: Array


def rotation_and_sensitivity(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    nonlinear: bool = False,
) -> tuple[Array, Array]:
    """Rotation of the left arm without inertia, and its derivatives d phi / d log p.

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

    Returns
    -------
    rotation : (n_times,)
        In rad; NaN where the nonlinear model has no answer.
    sensitivity : (n_parameters, n_times)
        In rad.
    """
    phi, slopes = _in_time(modes_of(gripper, model, torque, parameters), torque, time_s)
    if nonlinear:
        steps = _STEP * np.concatenate((np.zeros((1, len(parameters))), _both_ways(parameters)))
        found = correction(gripper, model.network(parameters * np.exp(steps)), torque, COARSE)
        values = np.where(found.converged[:, None], found.at(time_s), np.nan)
        phi = phi + values[0]
        slopes = slopes + np.nan_to_num((values[1::2] - values[2::2]) / (2 * _STEP))
    return phi, slopes


def modes_of(
    gripper: Gripper, model: SampleModel, torque: TorqueHistory, parameters: Array
) -> Modes:
    """Poles and weights of one sample without inertia, with their derivatives."""
    count = len(parameters)
    # The first row is the sample itself, each other has one parameter tilted.
    tilted = parameters * (1 + 1j * _TILT * np.eye(count + 1, count, -1))
    transfer = transfer_functions(gripper, model.network(tilted), symmetric=torque.symmetric)
    real: Array = transfer.denominator[:1].real
    rates = np.repeat(poles(real, real=True), count + 1, axis=0)
    newton = -evaluate(transfer.denominator, rates).imag / slope_at_poles(real, rates[:1])
    weights = partial_fractions(transfer, rates + 1j * newton).weights[:, LEFT]
    return Modes(rates[0], weights[0].real, newton[1:] / _TILT, weights[1:].imag / _TILT)


def _both_ways(parameters: Array) -> Array:
    """Unit steps of each parameter, forward and back in turn."""
    unit = np.eye(len(parameters))
    return np.stack((unit, -unit), axis=1).reshape(-1, len(parameters))


def _in_time(modes: Modes, torque: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Superpose what every jump and sinusoid of the torque sets off."""
    # First row the rotation, then its derivatives.
    rows = np.zeros((1 + len(modes.rate_slopes), len(time_s)))
    symmetric = len(modes.weights) == 1
    rate = modes.rates[:, None]
    jumps = drives(torque.left, torque.right, symmetric)
    for start, jump in zip(torque.time_s, np.moveaxis(jumps, 1, 0), strict=True):
        first = np.searchsorted(time_s, start)
        elapsed = time_s[first:] - start
        for order in np.flatnonzero(np.any(jump != 0, axis=0)):
            growth, slope = _growth(int(order), rate, elapsed)
            rows[:, first:] += _mix(modes, jump[:, order], growth, slope)
    amplitudes = drives(torque.harmonic_left, torque.harmonic_right, symmetric)
    for start, omega, a in zip(
        torque.harmonic_time_s, torque.omega_rad_per_s, amplitudes.T, strict=True
    ):
        first = np.searchsorted(time_s, start)
        swung = _swing(omega, rate, time_s[first:] - start)
        rows[:, first:] += _mix(modes, a, *swung).real
    return rows[0], rows[1:]


def _mix(
    modes: Modes, height: NDArray[Any], growth: NDArray[Any], slope: NDArray[Any]
) -> NDArray[Any]:
    """Weigh what the modes do; d(w g) = dw g + w dr dg/dr."""
    weight = height @ modes.weights
    by_growth = np.concatenate((weight[None], height @ modes.weight_slopes))
    by_slope = np.concatenate((np.zeros_like(weight)[None], weight * modes.rate_slopes))
    return np.concatenate((by_growth, by_slope), axis=1) @ np.concatenate((growth, slope))


def _growth(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Response of a mode to t^order/order!, over its weight, and its derivative by the rate.

    With z = r t these are r t^(n+1) phi_(n+1)(z) and t^(n+1) [phi_n(z) - n phi_(n+1)(z)],
    for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z).
    """
    z = rate * elapsed
    if order == 0:
        growth = np.expm1(z)
        return growth, elapsed * (growth + 1)
    power = elapsed ** (order + 1)
    this, before = phi_function(order + 1, z), phi_function(order, z)
    return rate * power * this, power * (before - order * this)


def _swing(
    omega: float, rate: Array, elapsed: Array
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Response of a mode to e^(i omega t), over its weight, and its derivative by the rate."""
    decay = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - decay
    share = rate / (1j * omega - rate)
    slope = 1j * omega / (1j * omega - rate) ** 2
    return share * difference, slope * difference - share * elapsed * decay
