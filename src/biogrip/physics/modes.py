"""Torques of a protocol that lag behind by a relaxation time.

Poles and weights of the linear model, with derivatives by the sample's parameters.

A parameter with a relative imaginary part of 1e-30 carries its derivative through
the arithmetic of the transfer function without changing the real part (complex
step). Poles and weights are differentiated analytically, without cancellation for slow
or fast modes. The result for a sample does not depend, to the last bit, on the other
samples.

Modes of a sample under what the protocol holds: a torque, a load, or a deformation.

References
----------
.. [1] W. Squire and G. Trapp, Using complex variables to estimate derivatives of real
   functions, SIAM Review 40 (1998), 110-112.
.. [2] J. R. R. A. Martins, P. Sturdza and J. J. Alonso, The complex-step derivative
   approximation, ACM Transactions on Mathematical Software 29 (2003), 245-262.
"""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray, parts
from biogrip.physics.gripper import Gripper
from biogrip.physics.linear import (
    LEFT,
    StepResponse,
    evaluate,
    poles,
    rotation,
    slope_at_poles,
    transfer_functions,
)
from biogrip.physics.many_branches import modes_with_slopes
from biogrip.physics.mode_growth import compute_decay, compute_growth
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import MOST_BRANCHES, Network, SampleModel


def lagged_torques(torque: TorqueHistory, shares: Sequence[float]) -> Callable[[Array], Array]:
    """Return a function of time for lagged torques, of the left arm and the difference of arms.

    Of a deformation, it is for the forces of springs that forget it with these relaxation times.

    Parameters
    ----------
    torque
        The protocol.
    shares
        Relaxation times of the lags over the protocol's duration.
    """
    drives = 1 if torque.symmetric else 2
    rates = -1 / (torque.end_s * np.tile(shares, drives))
    if torque.deforms:
        return lambda time_s: compute_decay(rates[:, None], torque, time_s)[0][:, 0, 0]
    static = np.repeat(np.eye(drives), len(shares), axis=0)[:, None, :]
    lags = StepResponse(static, rates[:, None], -static[..., None])
    return lambda time_s: rotation(lags, torque, time_s)


COMPLEX_STEP = 1e-30
"""Relative imaginary part of a parameter that carries its derivative."""


class Modes(NamedTuple):
    """Step responses of n samples' left arm, and their derivatives by the log-parameters."""

    rates: Array
    """In 1/s, (n, n_modes), negative."""
    weights: Array
    """In rad per N m, (n, n_drives, n_modes)."""
    rate_slopes: Array
    """(n, n_parameters, n_modes)."""
    weight_slopes: Array
    """(n, n_parameters, n_drives, n_modes)."""


def complex_step_network(
    model: SampleModel, parameters: Array, *, slopes: bool
) -> tuple[Network, int]:
    """Return networks of samples and, for slopes, of copies with complex-step parameters."""
    if not slopes:
        return model.network(parameters), 0
    count = parameters.shape[1]
    return model.network((parameters * _complex_steps(count)[:, None]).reshape(-1, count)), count


def compute_modes(
    gripper: Gripper, model: SampleModel, parameters: Array, *, symmetric: bool, slopes: bool = True
) -> Modes:
    """Compute the modes of samples, (n, n_parameters), without inertia, all of them real.

    All parameters are positive. Without `slopes` there are no derivatives: n_parameters is zero.
    """
    network, count = complex_step_network(model, parameters, slopes=slopes)
    if network.k.shape[1] > MOST_BRANCHES:
        parts = modes_with_slopes(gripper, network, COMPLEX_STEP, count, symmetric=symmetric)
        return Modes(*(np.ascontiguousarray(np.moveaxis(part, -1, 0)) for part in parts))
    numerators, denominator = transfer_functions(gripper, network, symmetric=symmetric)
    denominator, denominator_slopes = _split_complex_step(denominator, count)
    numerators, numerator_slopes = _split_complex_step(numerators[LEFT], count)
    rates = poles(denominator, real=True)
    slope = slope_at_poles(denominator, rates)
    # A pole stays where the denominator is zero.
    rate_slopes = -evaluate(denominator_slopes, rates) / slope
    # Of log(p_j D'(p_j)), with D'(p_j) the leading coefficient times all p_j - p_i.
    steepening = rate_slopes / rates + (denominator_slopes[..., -1] / denominator[:, -1])[..., None]
    for i, j in permutations(range(rates.shape[1]), 2):
        approach = rate_slopes[..., i] - rate_slopes[..., j]
        steepening[..., i] += approach / (rates[:, i] - rates[:, j])
    weights = evaluate(numerators, rates) / (rates * slope)
    along = evaluate(numerators[..., 1:] * np.arange(1, numerators.shape[-1]), rates)
    change = evaluate(numerator_slopes, rates) + along * rate_slopes[:, None]
    weight_slopes = change / (rates * slope) - weights * steepening[:, None]
    return Modes(
        rates,
        weights.swapaxes(0, 1),
        rate_slopes.swapaxes(0, 1),
        weight_slopes.transpose(2, 0, 1, 3),
    )


def _split_complex_step(coefficients: NDArray[Any], count: int) -> tuple[Array, Array]:
    """Return coefficients, (..., n, terms), and derivatives, (n_parameters, ..., n, terms)."""
    *others, _, terms = coefficients.shape
    of_tilts = coefficients.reshape(*others, count + 1, -1, terms).swapaxes(0, -3)
    return of_tilts[0].real, of_tilts[1:].imag / COMPLEX_STEP


@cache
def _complex_steps(count: int) -> ComplexArray:
    """Return factors: ones in the first row, and one complex-step parameter in each other row."""
    tilts = np.ones((count + 1, count), dtype=np.complex128)
    tilts[1:].imag = COMPLEX_STEP * np.eye(count)
    return tilts


# Rate at which a bare damper forgets, in 1/s; its force is c times the rate of the deformation.
_AT_ONCE = 1e30
# Numbers formed together, which should fit a processor's cache.
_TOGETHER = 400_000


def compute_protocol_modes(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Modes:
    """Compute the modes of samples, (n, n_parameters), without inertia, all of them real.

    Arguments are those of `compute_modes`, with the protocol. Of a protocol that deforms, weights
    are forces over deformations.
    """
    if torque.deforms:
        return _relaxation_modes(model, parameters, slopes=slopes)
    return compute_modes(gripper, model, parameters, symmetric=torque.symmetric, slopes=slopes)


def compute_responses(modes: Modes, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute responses of modes to a protocol, and their derivatives by the log-parameters.

    (n, 1 + n_parameters, n_times): d(w g) = dw g + w dr dg/dr.
    """
    n, count, m = modes.rate_slopes.shape
    drives = modes.weights.shape[1]
    by_growth = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_growth)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes[:, :, None]
    mixing = np.concatenate((by_growth, by_slope), axis=2).reshape(n, 1 + count, -1)
    rows = np.empty((n, 1 + count, len(time_s)))
    at_once = max(1, _TOGETHER // (m * len(time_s)))
    for some in parts(n, at_once):
        both = np.concatenate(compute_growth(modes.rates[some], torque, time_s), axis=1)
        both = both.reshape(-1, 2 * drives * m, len(time_s))
        # One product per sample: the order of its sums does not depend on the number of samples.
        rows[some] = mixing[some] @ both
    return rows


def relaxation(network: Network, history: TorqueHistory, time_s: Array) -> Array:
    """Compute the load on samples that a protocol deforms, (n, n_times)."""
    rates, weights = _branches(network)
    decay, _ = compute_decay(rates, history, time_s)
    load: Array = (weights[:, None] @ decay[:, 0])[:, 0]
    return load


def _relaxation_modes(model: SampleModel, parameters: Array, *, slopes: bool) -> Modes:
    network, count = complex_step_network(model, parameters, slopes=slopes)
    rates, weights = _branches(network)
    weights, weight_slopes = _split(weights, count)
    rates, rate_slopes = _split(rates, count)
    return Modes(rates, weights[:, None], rate_slopes, weight_slopes[:, :, None])


def _branches(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rates and stiffnesses of all elements beside one another, (n, n_modes).

    A branch forgets at the rate -k/c, a bare spring never, and a bare damper at once.
    """
    bare = np.stack((network.k_p, _AT_ONCE * network.c_p), axis=1)
    fixed = np.broadcast_to([0.0, -_AT_ONCE], bare.shape)
    # A branch so weak that its numbers underflow is none.
    there = network.c.real > 0
    rates = -network.k / np.where(there, network.c, 1.0)
    weights = np.where(there, network.k, 0.0)
    return np.concatenate((rates, fixed), axis=1), np.concatenate((weights, bare), axis=1)


def _split(values: NDArray[Any], count: int) -> tuple[Array, Array]:
    """Return values, (n, n_modes), and derivatives, (n, n_parameters, n_modes)."""
    steps = values.reshape(count + 1, -1, values.shape[1])
    return np.ascontiguousarray(steps[0].real), steps[1:].imag.swapaxes(0, 1) / COMPLEX_STEP
