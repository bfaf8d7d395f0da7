"""How the rotation changes with the sample's parameters: exact derivatives, no differences.

A parameter with a relative imaginary part of 1e-30 carries its derivative through
the arithmetic of the transfer function without touching the real part (complex
step). Poles, weights and exponentials in time are differentiated by hand, with no
cancellation at either end. What is found for a sample does not depend, to the last
bit, on which others are looked at with it.

References
----------
.. [1] W. Squire and G. Trapp, Using complex variables to estimate derivatives of real
   functions, SIAM Review 40 (1998), 110-112.
.. [2] J. R. R. A. Martins, P. Sturdza and J. J. Alonso, The complex-step derivative
   approximation, ACM Transactions on Mathematical Software 29 (2003), 245-262.
"""

from dataclasses import dataclass
from functools import cache
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.network import MOST_BRANCHES
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import (
    LEFT,
    evaluate,
    phi_function,
    poles,
    slope_at_poles,
    transfer_functions,
)
from biogrip.response.many_branches import modes_with_slopes
from biogrip.response.nonlinear import COARSE, Correction, correction

_TILT = 1e-30
# The correction is of second order itself; its derivative by differences is good to 1e-6 of that.
_STEP = 1e-3


@dataclass(frozen=True)
class Modes:
    """Step responses of n samples' left arm, and their derivatives by the log-parameters.

    Parameters
    ----------
    rates : (n, n_modes)
        In 1/s, real and negative.
    weights : (n, n_drives, n_modes)
        In rad per N m.
    rate_slopes : (n, n_parameters, n_modes)
    weight_slopes : (n, n_parameters, n_drives, n_modes)
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
    modes = modes_of(gripper, model, torque, parameters[None])
    phi, slopes = _mixed(modes, *responses_of_modes(modes.rates[0], torque, time_s))
    if nonlinear:
        found = corrections(gripper, model, torque, parameters[None])
        values = np.where(found.converged[:, None], found.at(time_s), np.nan)
        phi = phi + values[0]
        slopes = slopes + np.nan_to_num(differences(values[None])[0, 1:])
    return phi, slopes


def corrections(
    gripper: Gripper, model: SampleModel, torque: TorqueHistory, parameters: Array
) -> Correction:
    """Nonlinear minus linear rotation of samples, and of those that are a little different.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    parameters : (n, n_parameters)
        All positive.

    Returns
    -------
    Correction
        Of n (1 + 2 n_parameters) samples, see `differences`.
    """
    count = parameters.shape[1]
    steps = _STEP * np.concatenate((np.zeros((1, count)), _both_ways(count)))
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


def modes_of(
    gripper: Gripper, model: SampleModel, torque: TorqueHistory, parameters: Array
) -> Modes:
    """Poles and weights of samples without inertia, with their derivatives.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    parameters : (n, n_parameters)
        All positive.
    """
    count = parameters.shape[1]
    tilted = (parameters * _tilts(count)[:, None]).reshape(-1, count)
    network = model.network(tilted)
    if network.k.shape[1] > MOST_BRANCHES:
        parts = modes_with_slopes(gripper, network, _TILT, count, symmetric=torque.symmetric)
        return Modes(*(np.ascontiguousarray(np.moveaxis(part, -1, 0)) for part in parts))
    transfer = transfer_functions(gripper, network, symmetric=torque.symmetric)
    denominator, denominator_slopes = _untilted(transfer.denominator, count)
    rates = poles(denominator, real=True)
    slope = slope_at_poles(denominator, rates)
    # A pole stays where the denominator is zero.
    rate_slopes = -evaluate(denominator_slopes, rates) / slope
    # Of log(p_j D'(p_j)), with D'(p_j) the leading coefficient times all p_j - p_i.
    steepening = rate_slopes / rates + (denominator_slopes[..., -1] / denominator[:, -1])[..., None]
    for i, j in permutations(range(rates.shape[1]), 2):
        approach = rate_slopes[..., i] - rate_slopes[..., j]
        steepening[..., i] += approach / (rates[:, i] - rates[:, j])
    weights, weight_slopes = [], []
    for row in transfer.numerators[LEFT]:
        numerator, numerator_slopes = _untilted(row, count)
        weight = evaluate(numerator, rates) / (rates * slope)
        along = evaluate(numerator[:, 1:] * np.arange(1, numerator.shape[1]), rates)
        change = evaluate(numerator_slopes, rates) + along * rate_slopes
        weights.append(weight)
        weight_slopes.append(change / (rates * slope) - weight * steepening)
    return Modes(
        rates,
        np.array(weights).swapaxes(0, 1),
        rate_slopes.swapaxes(0, 1),
        np.array(weight_slopes).transpose(2, 1, 0, 3),
    )


def _untilted(coefficients: NDArray[Any], count: int) -> tuple[Array, Array]:
    """Polynomials of n samples, (n, terms), and their derivatives, (n_parameters, n, terms)."""
    of_tilts = coefficients.reshape(count + 1, -1, coefficients.shape[1])
    return of_tilts[0].real, of_tilts[1:].imag / _TILT


@cache
def _tilts(count: int) -> ComplexArray:
    """Factors with the sample itself in the first row, and one parameter tilted in each other."""
    tilts = np.ones((count + 1, count), dtype=np.complex128)
    tilts[1:].imag = _TILT * np.eye(count)
    return tilts


def _both_ways(count: int) -> Array:
    """Unit steps of each parameter, forward and back in turn."""
    unit = np.eye(count)
    return np.stack((unit, -unit), axis=1).reshape(-1, count)


def responses_of_modes(rates: Array, torque: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Superpose what every jump and sinusoid of the torque sets off in modes of unit weight.

    Parameters
    ----------
    rates : (n_modes,)
        In 1/s, real and negative.
    torque
        The protocol; decides the drives, see `drives`.
    time_s : (n_times,)
        Ascending times.

    Returns
    -------
    growth, slope : (n_drives, n_modes, n_times)
        The responses in N m, and their derivatives by the rate.
    """
    rate = rates[:, None]
    growth, slope = np.zeros((2, 1 if torque.symmetric else 2, len(rates), len(time_s)))
    for start, order, heights in torque.jumps:
        first = time_s.searchsorted(start)
        grown, slanted = _growth(order, rate, time_s[first:] - start)
        height = heights[:, None, None]
        growth[..., first:] += height * grown
        slope[..., first:] += height * slanted
    for start, omega, amplitudes in torque.swings:
        first = time_s.searchsorted(start)
        swung, swung_slanted = _swing(omega, rate, time_s[first:] - start)
        phasor = amplitudes[:, None, None]
        growth[..., first:] += (phasor * swung).real
        slope[..., first:] += (phasor * swung_slanted).real
    return growth, slope


def _mixed(modes: Modes, growth: Array, slope: Array) -> tuple[Array, Array]:
    """Weigh what the modes do; d(w g) = dw g + w dr dg/dr."""
    weights, times = modes.weights[0], growth.shape[-1]
    slanted = weights * modes.rate_slopes[0][:, None]
    by_growth = np.concatenate((weights[None], modes.weight_slopes[0]))
    by_slope = np.concatenate((np.zeros_like(weights)[None], slanted))
    both = np.concatenate(
        (by_growth.reshape(len(by_growth), -1), by_slope.reshape(len(by_slope), -1)), axis=1
    )
    rows: Array = both @ np.concatenate((growth, slope)).reshape(-1, times)
    return rows[0], rows[1:]


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


def _swing(omega: float, rate: Array, elapsed: Array) -> tuple[ComplexArray, ComplexArray]:
    """Response of a mode to e^(i omega t), over its weight, and its derivative by the rate."""
    decay = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - decay
    share = rate / (1j * omega - rate)
    slope = 1j * omega / (1j * omega - rate) ** 2
    return share * difference, slope * difference - share * elapsed * decay
