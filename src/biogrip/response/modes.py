"""Poles and weights of the linear model, with derivatives by the sample's parameters.

A parameter with a relative imaginary part of 1e-30 carries its derivative through
the arithmetic of the transfer function without changing the real part (complex
step). Poles and weights are differentiated analytically, without cancellation for slow
or fast modes. The result for a sample does not depend, to the last bit, on the other
samples.

References
----------
.. [1] W. Squire and G. Trapp, Using complex variables to estimate derivatives of real
   functions, SIAM Review 40 (1998), 110-112.
.. [2] J. R. R. A. Martins, P. Sturdza and J. J. Alonso, The complex-step derivative
   approximation, ACM Transactions on Mathematical Software 29 (2003), 245-262.
"""

from functools import cache
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.network import MOST_BRANCHES, Network
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import LEFT, evaluate, poles, slope_at_poles, transfer_functions
from biogrip.response.many_branches import modes_with_slopes

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
