"""The corrected linear model, eqs. (4)-(6), solved exactly for any protocol.

With Z_i(s) = I_i s^2 + c_i s + k_i the impedance of an arm, G(s) = P/Q that of
the sample and b = l sin(hat-theta_2) the lever of both arms, the closing
rotations are

    phi_2 = [Z_4 Q tau_2 + b^2 P (tau_2 - tau_4)] / D
    phi_4 = [Z_2 Q tau_2 - (Z_2 Q + b^2 P) (tau_2 - tau_4)] / D
    D     = Z_2 Z_4 Q + b^2 P (Z_2 + Z_4)

and with equal arms and torques, after Z cancels, phi = Q tau / (Z Q + 2 b^2 P).
Written like this no coefficient of D is a difference, so none loses digits.
"""

from dataclasses import dataclass
from functools import reduce
from itertools import permutations
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.many_branches import modes_of_many
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.roots import real_quadratic_roots, roots, separate
from biogrip.physics.sample_model import MOST_BRANCHES, Network

LEFT, RIGHT = 0, 1


@dataclass(frozen=True)
class StepResponse:
    """Response of n samples to unit torque steps, as a constant plus exponentials.

    A unit step of drive d at time 0 turns arm a (`LEFT`, `RIGHT`) by
    ``static[:, a, d] + sum_j weights[:, a, d, j] exp(rates[:, j] t)``.
    """

    static: Array
    """Final rotation in rad per N m, (n, n_arms, n_drives)."""
    rates: NDArray[Any]
    """Exponents in 1/s, (n, n_modes), real without inertia, complex with it."""
    weights: NDArray[Any]
    """In rad per N m, (n, n_arms, n_drives, n_modes)."""


def is_symmetric(gripper: Gripper, torque: TorqueHistory) -> bool:
    """Return True if both arms move alike, so that one stands for both."""
    return torque.symmetric and gripper.left == gripper.right


def step_response(
    gripper: Gripper, network: Network, *, symmetric: bool = True, inertia: bool = True
) -> StepResponse:
    """Solve the linear model for n samples at once (corrected eqs. 4-6).

    Parameters
    ----------
    gripper
        Its arms may differ.
    network
        The samples.
    symmetric
        True if both arms are driven alike; determines the drives, see `drives`.
    inertia
        True to include inertia: arms ring for milliseconds. Without inertia, all rates are
        real and negative.
    """
    if network.k.shape[1] > MOST_BRANCHES:
        return StepResponse(*modes_of_many(gripper, network, symmetric=symmetric, inertia=inertia))
    transfer = transfer_functions(gripper, network, symmetric=symmetric, inertia=inertia)
    return partial_fractions(*transfer, real=not inertia)


def transfer_functions(
    gripper: Gripper, network: Network, *, symmetric: bool, inertia: bool = False
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rotation over torque as quotients of polynomials in s; see `step_response`.

    Parameters may be complex, as only arithmetic is done with them.

    Returns
    -------
    numerators : (2, n_drives, n, terms)
        One for each arm and drive, in ascending powers.
    denominator : (n, terms)
        Their common denominator.
    """
    p, q = sample_polynomials(network)
    z_2, z_4 = (arm_polynomial(arm, inertia) for arm in (gripper.left, gripper.right))
    coupled = gripper.lever_m**2 * p
    if symmetric and gripper.left == gripper.right:
        denominator = add(multiply(z_2, q), 2 * coupled)
        return q[None, None].repeat(2, axis=0).swapaxes(2, 3), denominator.T
    left, right = multiply(z_4, q), multiply(z_2, q)
    padded = add(coupled, np.zeros_like(left))
    numerators = np.array([[left, padded], [right, -add(right, coupled)]])
    denominator = add(
        multiply(multiply(z_2, z_4), q), gripper.lever_m**2 * multiply(p, add(z_2, z_4))
    )
    return numerators[:, : 1 if symmetric else 2].swapaxes(2, 3), denominator.T


def rotation(
    response: StepResponse,
    torque: TorqueHistory,
    time_s: Array,
    arm: int = LEFT,
    *,
    rate: bool = False,
) -> Array:
    """Compute an arm's closing rotation in rad, or its rate in rad/s, (n, n_times), at any times.

    Responses to changes of torque superpose. A step response starts at zero,
    so h(t) = sum_j w_j (e^(p_j t) - 1), which loses no digits to the constant
    if a sample creeps far from its rest. Ramps and parabolas are its integrals.
    """
    phi = np.zeros((len(response.static), len(time_s)))
    # Arms that differ have a second drive, which does nothing if both are driven alike.
    weights = response.weights[:, arm, : 1 if torque.symmetric else 2]
    rates = response.rates[:, :, None]
    for start, order, heights in torque.jumps:
        after = time_s >= start
        growth = _growth(order - rate, rates, time_s[after] - start)
        amplitude = np.einsum("ndj,d->nj", weights, heights)
        phi[:, after] += np.einsum("nj,njt->nt", amplitude, growth).real
    return phi


def _growth(order: int, rates: NDArray[Any], elapsed: Array) -> NDArray[Any]:
    """Return a mode's response over its weight to t^order/order!; for order -1, to an impulse."""
    z = rates * elapsed
    if order < 0:
        return rates * np.exp(z)
    if order == 0:
        return np.expm1(z)
    return rates * elapsed ** (order + 1) * phi_function(order + 1, z)


def phi_function(order: int, z: NDArray[Any]) -> NDArray[Any]:
    """Compute phi_n(z) = (e^z - sum_{k<n} z^k/k!) / z^n without cancellation near zero.

    References
    ----------
    .. [1] M. Hochbruck and A. Ostermann, Exponential integrators, Acta Numerica 19 (2010),
       209-286.
    """
    small = np.abs(z) < 1.0
    near = np.where(small, z, 0)
    series = np.zeros_like(near)
    for k in range(18, -1, -1):
        series = series * near + 1 / factorial(k + order)
    far = np.where(small, 1, z)
    value = np.expm1(far) / far
    for n in range(1, order):
        value = (value - 1 / factorial(n)) / far
    return np.where(small, series, value)


def sample_polynomials(network: Network) -> tuple[Array, Array]:
    """Return P and Q of the sample's impedance P/Q, ascending powers, shape (terms, n).

    The node between spring and damper of a branch, corrected (3) and (6), is eliminated.
    Each branch enters as c_j s / (1 + T_j s) with its relaxation time T_j = c_j/k_j.
    """
    one = np.ones((1, len(network.k_p)))
    factors = [np.concatenate((one, t[None])) for t in (network.c / network.k).T]
    q = _product(factors, one)
    p = multiply(np.array((network.k_p, network.c_p)), q)
    for j, c_j in enumerate(network.c.T):
        others = _product(factors[:j] + factors[j + 1 :], one)
        p[1 : 1 + len(others)] += c_j * others
    return p, q


def arm_polynomial(arm: Arm, inertia: bool) -> Array:
    """Return the impedance Z of a free arm, ascending powers, shape (terms, 1)."""
    coefficients = [arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad, arm.inertia_kgm2]
    return np.array(coefficients if inertia else coefficients[:2])[:, None]


def multiply(a: Array, b: Array) -> Array:
    """Multiply polynomials in ascending powers, shape (terms, n) each."""
    terms, n = len(a) + len(b) - 1, max(a.shape[1], b.shape[1])
    product = np.zeros((terms, n), dtype=np.result_type(a, b))
    for i, a_i in enumerate(a):
        product[i : i + len(b)] += a_i * b
    return product


def add(a: Array, b: Array) -> Array:
    """Add polynomials in ascending powers, shape (terms, n) each."""
    terms, n = max(len(a), len(b)), max(a.shape[1], b.shape[1])
    total = np.zeros((terms, n), dtype=np.result_type(a, b))
    total[: len(a)] += a
    total[: len(b)] += b
    return total


def _product(factors: list[Array], one: Array) -> Array:
    return reduce(multiply, factors) if factors else one


def poles(denominator: Array, *, real: bool) -> NDArray[Any]:
    """Compute the roots of denominators, shape (n, n_modes), moved apart if they coincide."""
    if denominator.shape[1] == 2:
        return -(denominator[:, :1] / denominator[:, 1:])
    if denominator.shape[1] == 3 and real:
        return real_quadratic_roots(denominator)
    found = roots(denominator)
    return separate(found.real) if real else found


def slope_at_poles(denominator: NDArray[Any], rates: NDArray[Any]) -> NDArray[Any]:
    """Compute the derivative of denominators at their roots, as a product over root distances."""
    slope = np.empty_like(rates, dtype=np.result_type(denominator, rates))
    slope[:] = denominator[:, -1:]
    for i, j in permutations(range(rates.shape[1]), 2):
        slope[:, i] *= rates[:, i] - rates[:, j]
    return slope


def partial_fractions(
    numerators: NDArray[Any], denominator: NDArray[Any], *, real: bool
) -> StepResponse:
    """Compute the step response of N/D, N(0)/D(0) + sum_j N(p_j) / (p_j D'(p_j)) e^(p_j t)."""
    rates = poles(denominator, real=real)
    slope = rates * slope_at_poles(denominator, rates)
    found = numerators[..., 0] / denominator[:, 0], evaluate(numerators, rates) / slope
    static, weights = (np.ascontiguousarray(np.moveaxis(of, 2, 0)) for of in found)
    return StepResponse(static, rates, weights)


def evaluate(coefficients: NDArray[Any], z: NDArray[Any]) -> NDArray[Any]:
    """Evaluate polynomials, ascending powers, shape (..., n, terms), at z, (n, n_points)."""
    value: NDArray[Any] = np.zeros(1)
    for term in range(coefficients.shape[-1])[::-1]:
        value = value * z + coefficients[..., term, None]
    return value
