"""The corrected linear model, eqs. (4)-(6), solved exactly for torque steps.

With Z_i(s) = I_i s^2 + c_i s + k_i the impedance of an arm, G(s) = P/Q that of
the sample and b = l sin(hat-theta_2) the lever of both arms, the closing
rotation of the left arm is

    phi_2 = [Z_4 Q tau_2 + b^2 P (tau_2 - tau_4)] / D
    D     = Z_2 Z_4 Q + b^2 P (Z_2 + Z_4)

and with equal arms and torques, after Z cancels, phi = Q tau / (Z Q + 2 b^2 P).
Written like this no coefficient of D is a difference, so none loses digits.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.gripper import Arm, Gripper
from biogrip.protocol import TorqueSteps
from biogrip.response.roots import real_quadratic_roots, roots, separate
from biogrip.sample import Network


@dataclass(frozen=True)
class StepResponse:
    """Response of n samples to unit torque steps, as a constant plus exponentials.

    A unit step of drive d at time 0 turns the left arm by
    ``static[:, d] + sum_j weights[:, d, j] exp(rates[:, j] t)``.

    Parameters
    ----------
    static : (n, n_drives)
        Final rotation in rad per N m.
    rates : (n, n_modes)
        Exponents in 1/s, real without inertia, complex with it.
    weights : (n, n_drives, n_modes)
        In rad per N m.
    """

    static: Array
    rates: NDArray[Any]
    weights: NDArray[Any]


def drives(steps: TorqueSteps) -> Array:
    """Step heights in N m of the drives of `step_response`, shape (n_drives, n_steps).

    One drive, the common torque, if both arms are driven alike; else tau_2 and
    tau_2 - tau_4.
    """
    if steps.symmetric:
        return steps.left_Nm[None, :]
    return np.stack((steps.left_Nm, steps.left_Nm - steps.right_Nm))


def step_response(
    gripper: Gripper,
    network: Network,
    *,
    symmetric_torque: bool = True,
    inertia: bool = True,
) -> StepResponse:
    """Solve the linear model for n samples at once (corrected eqs. 4-6).

    Parameters
    ----------
    gripper
        Its arms may differ.
    network
        The samples.
    symmetric_torque
        Whether both arms are driven alike; decides the drives, see `drives`.
    inertia
        Without it the ring of the arms, over within milliseconds, is left out
        and all rates are real and negative.
    """
    p, q = _sample_polynomials(network)
    z_2 = _arm_polynomial(gripper.left, inertia)
    z_4 = _arm_polynomial(gripper.right, inertia)
    coupling = gripper.lever_m**2
    if symmetric_torque and gripper.left == gripper.right:
        numerators = [q]
        denominator = _add(_multiply(z_2, q), 2 * coupling * p)
    else:
        numerators = [_multiply(z_4, q)]
        if not symmetric_torque:
            numerators.append(coupling * p)
        arms = _multiply(z_2, z_4)
        denominator = _add(_multiply(arms, q), coupling * _multiply(p, _add(z_2, z_4)))
    return _partial_fractions(numerators, denominator, real=not inertia)


def rotation(response: StepResponse, steps: TorqueSteps, time_s: Array) -> Array:
    """Closing rotation of the left arm in rad, shape (n, n_times).

    Steps superpose: phi(t) = sum_s dtau_s h(t - t_s), whatever the sampling. A
    step response starts at zero, so h(t) = sum_j w_j (e^(p_j t) - 1), which loses
    no digits to the constant where a sample creeps far from its rest.
    """
    heights = drives(steps)
    phi = np.zeros((response.static.shape[0], len(time_s)))
    for start, height in zip(steps.time_s, heights.T, strict=True):
        after = time_s >= start
        elapsed = time_s[after] - start
        change = np.expm1(response.rates[:, :, None] * elapsed)
        weights = np.einsum("ndj,d->nj", response.weights, height)
        phi[:, after] += np.einsum("nj,njt->nt", weights, change).real
    return phi


def _sample_polynomials(network: Network) -> tuple[Array, Array]:
    """P and Q of the sample's impedance P/Q, ascending powers, shape (n, ...).

    Each branch enters as c_j s / (1 + T_j s) with its relaxation time T_j = c_j/k_j.
    """
    relaxation = network.c / network.k
    one = np.ones(len(network.k_p))
    factors = [np.stack((one, t), axis=1) for t in relaxation.T]
    q = _product(factors, one)
    p = _multiply(np.stack((network.k_p, network.c_p), axis=1), q)
    for j, c_j in enumerate(network.c.T):
        others = _product(factors[:j] + factors[j + 1 :], one)
        p = _add(p, _multiply(np.stack((0 * one, c_j), axis=1), others))
    return p, q


def _arm_polynomial(arm: Arm, inertia: bool) -> Array:
    coefficients = [arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad, arm.inertia_kgm2]
    return np.array([coefficients if inertia else coefficients[:2]])


def _multiply(a: Array, b: Array) -> Array:
    n, terms = max(len(a), len(b)), a.shape[1] + b.shape[1] - 1
    product = np.zeros((n, terms))
    for i in range(a.shape[1]):
        product[:, i : i + b.shape[1]] += a[:, i, None] * b
    return product


def _add(a: Array, b: Array) -> Array:
    terms = max(a.shape[1], b.shape[1])
    total = np.zeros((max(len(a), len(b)), terms))
    total[:, : a.shape[1]] += a
    total[:, : b.shape[1]] += b
    return total


def _product(factors: list[Array], one: Array) -> Array:
    product = one[:, None]
    for factor in factors:
        product = _multiply(product, factor)
    return product


def _partial_fractions(numerators: list[Array], denominator: Array, *, real: bool) -> StepResponse:
    """Step response of N(s)/D(s): N(0)/D(0) + sum_j N(p_j) / (p_j D'(p_j)) e^(p_j t)."""
    rates: NDArray[Any]
    if denominator.shape[1] == 2:
        rates = -(denominator[:, :1] / denominator[:, 1:])
    elif denominator.shape[1] == 3 and real:
        rates = real_quadratic_roots(denominator)
    elif real:
        rates = separate(roots(denominator).real)
    else:
        rates = roots(denominator)
    distance = rates[:, :, None] - rates[:, None, :]
    distance += np.eye(rates.shape[1])
    slope = denominator[:, -1:] * np.prod(distance, axis=2)
    static = np.stack([n[:, 0] / denominator[:, 0] for n in numerators], axis=1)
    weights = np.stack([_evaluate(n, rates) / (rates * slope) for n in numerators], axis=1)
    return StepResponse(static, rates, weights)


def _evaluate(coefficients: Array, z: NDArray[Any]) -> NDArray[Any]:
    value = np.zeros_like(z)
    for coefficient in coefficients.T[::-1]:
        value = value * z + coefficient[:, None]
    return value
