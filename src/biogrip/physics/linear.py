"""The corrected linear model, eqs. (4)-(6), solved exactly for any protocol.

With Z_i(s) = I_i s^2 + c_i s + k_i the impedance of an arm, G(s) that of the sample and
b = l sin(hat-theta_2) the lever of both arms, the closing rotations are

    phi_2 = [Z_4 tau_2 + b^2 G (tau_2 - tau_4)] / E
    phi_4 = [Z_2 tau_2 - (Z_2 + b^2 G) (tau_2 - tau_4)] / E
    E     = Z_2 Z_4 + b^2 G (Z_2 + Z_4)

and with equal arms and torques, after Z cancels, phi = tau / (Z + 2 b^2 G). The jaws exert the
force F = G delta on the sample, positive while they press:

    F = [b G (Z_2 + Z_4) tau_2 - b G Z_2 (tau_2 - tau_4)] / E

or 2 b G tau / (Z + 2 b^2 G). The arm's equation gives it too, b F = tau - Z phi, but where a liquid
has given way that is a difference of nearly equal torques; here the constant and every mode are
products of what is positive, and late in a phase only what is left of the slow modes is summed.

Without inertia the arms, seen from the sample, have the impedance Z = Z_2 Z_4 / (Z_2 + Z_4), which
is that of a spring, a damper and one Maxwell branch. So with the sample's

    H = Z + b^2 G = A + B s + sum_j K_j s / (s + r_j)

is a sum of poles, and the rates x of the modes interlace with the r_j (`biogrip.physics.roots`).
Where H is zero, b^2 G is -Z, so the numerators N of

    phi_2 = [Z_4/(Z_2 + Z_4) tau_2 + b^2 G/(Z_2 + Z_4) (tau_2 - tau_4)] / H,

of phi_4 and of F follow from the arms alone. A mode of N/H has the weight -N/S with
S = A + sum_j K_j x^2/(x - r_j)^2, a sum of positive terms. Equal arms that are driven alike need no
branch of theirs: then 2 phi = tau/H. With inertia, see `biogrip.physics.inertia`.
"""

from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.inertia import Ringing, ascending, ascending_branches
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.roots import Zeros, interlaced_zeros
from biogrip.physics.sample_model import Network

LEFT, RIGHT = 0, 1

# Least difference of the arms: the branch of equal arms has no effect, but a mode.
_LEAST_DIFFERENCE = 1e-30


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
    return _solve(gripper, network, symmetric=symmetric, inertia=inertia, force=False)


def jaw_force_response(
    gripper: Gripper, network: Network, *, symmetric: bool = True, inertia: bool = True
) -> StepResponse:
    """Compute the jaw force of n samples after unit torque steps, in N per N m.

    The force takes the place of an arm. Arguments are those of `step_response`; without inertia a
    parallel damper makes the force jump with the torque.
    """
    return _solve(gripper, network, symmetric=symmetric, inertia=inertia, force=True)


def _solve(
    gripper: Gripper, network: Network, *, symmetric: bool, inertia: bool, force: bool
) -> StepResponse:
    arms = Arms(gripper, alike=symmetric and gripper.left == gripper.right)
    impedance = arms.with_sample(network)
    zeros = interlaced_zeros(impedance.weights, impedance.rates, impedance.level)
    static = arms.forces_at_rest(network) if force else arms.rotations_at_rest(network)
    if inertia:
        ringing = Ringing(gripper, network, zeros, alike=arms.alike)
        rates: NDArray[Any] = ringing.rates
        weights: NDArray[Any] = ringing.forces() if force else ringing.rotations()
    else:
        rates = np.ascontiguousarray(-zeros.values.T)
        numerators = arms.forces(zeros) if force else arms.rotations(zeros)[0]
        x, steepness = zeros.values, np.zeros_like(zeros.pole)
        for weight, rate in zip(impedance.weights, impedance.rates, strict=True):
            steepness += weight * (x / zeros.from_pole(rate)) ** 2
        weights = -numerators / steepness
    drives = slice(1 if symmetric else 2)
    static, weights = (np.moveaxis(of[:, drives], -1, 0) for of in (static, weights))
    return StepResponse(np.ascontiguousarray(static), rates, np.ascontiguousarray(weights))


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


def linear_jaw_force(response: StepResponse, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute the jaw force of the linear model in N, (n, n_times), at any times.

    The response is that of `jaw_force_response`; at the instant of a step: what follows it.
    """
    force = np.zeros((len(response.rates), len(time_s)))
    rates = response.rates[:, :, None]
    static, weights = response.static[:, 0], response.weights[:, 0]
    for start, order, heights in torque.jumps:
        after = time_s >= start
        elapsed = time_s[after] - start
        constant, amplitude = static @ heights, np.einsum("ndj,d->nj", weights, heights)
        z = rates * elapsed
        growth = elapsed**order * (phi_function(order, z) if order else np.exp(z))
        rest = constant[:, None] * elapsed**order / factorial(order)
        force[:, after] += rest + np.einsum("nj,njt->nt", amplitude, growth).real
    return force


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


@dataclass(frozen=True)
class Impedance:
    """Impedance H = Z + b^2 G of n samples between the arms."""

    weights: NDArray[Any]
    """A and the K_j, (1 + n_rates, n); complex if the samples' elements are."""
    rates: NDArray[Any]
    """Zero and the r_j, ascending, (1 + n_rates, n)."""
    level: NDArray[Any]
    """B, (n,)."""


class Arms:
    """Impedance of both arms as seen from the sample between them.

    The arms may differ; they are alike if they are equal, and driven alike.
    """

    def __init__(self, gripper: Gripper, *, alike: bool) -> None:
        self._lever_m = gripper.lever_m
        self.alike = alike
        arms = gripper.left, gripper.right
        self._c = np.array([arm.damping_Nms_per_rad for arm in arms])
        self._k = np.array([arm.stiffness_Nm_per_rad for arm in arms])
        (c_2, c_4), (k_2, k_4) = self._c, self._k
        self._rate = (k_2 + k_4) / (c_2 + c_4)
        # At a distance d from that rate Z_2 = -chi - c_2 d and Z_4 = chi - c_4 d.
        difference, least = k_4 * c_2 - k_2 * c_4, _LEAST_DIFFERENCE * k_4 * c_2
        self._chi = (difference if abs(difference) > least else least) / (c_2 + c_4)

    def with_sample(self, network: Network) -> Impedance:
        """Return the impedance with a sample between the arms."""
        b_2, k, c = self._lever_m**2, self._k, self._c
        springs, rates = ascending_branches(network)
        weights = b_2 * springs
        nothing = np.zeros((1, weights.shape[1]))
        if not self.alike:
            weights = np.concatenate((weights, nothing + self._chi**2 / k.sum()))
            rates = np.concatenate((rates, nothing + self._rate))
            weights, rates = ascending(weights, rates)
        spring = k.prod() / k.sum() + b_2 * network.k_p
        return Impedance(
            np.concatenate((spring[None], weights)),
            np.concatenate((nothing, rates)),
            c.prod() / c.sum() + b_2 * network.c_p,
        )

    def rotations(self, zeros: Zeros) -> tuple[Array, Array]:
        """Return N of the rotations of modes, (n_arms, n_drives, n_modes, n), and dN/dx."""
        if self.alike:
            half = np.full((2, 1, *zeros.pole.shape), 0.5)
            return half, np.zeros_like(half)
        left, right = self._c / self._c.sum()
        away = zeros.from_pole(np.asarray(self._rate))
        share = self._chi / self._c.sum() / away
        slope = -share / away
        through = (left + share) * (share - right)
        through_slope = slope * (left - right + 2 * share)
        return (
            np.array([[right - share, through], [left + share, -(left + share) - through]]),
            np.array([[-slope, through_slope], [slope, -slope - through_slope]]),
        )

    def forces(self, zeros: Zeros) -> Array:
        """Return N of the jaw force of modes, (1, n_drives, n_modes, n)."""
        (c_2, c_4), b = self._c, self._lever_m
        if self.alike:
            return 0.5 / b * (c_2 * zeros.values - self._k[0])[None, None]
        away = zeros.from_pole(np.asarray(self._rate))
        z_2, z_4 = -self._chi - c_2 * away, self._chi - c_4 * away
        whole = -(c_2 + c_4) * away
        return np.array([[-z_2 * z_4 / whole / b, (z_2 / whole) ** 2 * z_4 / b]])

    def rotations_at_rest(self, network: Network) -> Array:
        """Return the final rotations under unit torques, (n_arms, n_drives, n)."""
        k_2, k_4 = self._k
        sample = self._lever_m**2 * network.k_p
        spring = self._k.prod() / self._k.sum() + sample
        one = np.ones_like(spring)
        if self.alike:
            return np.array([[0.5 * one]] * 2) / spring
        rows = [[k_4 * one, sample], [k_2 * one, -(k_2 + sample)]]
        return np.array(rows) / self._k.sum() / spring

    def forces_at_rest(self, network: Network) -> Array:
        """Return the final jaw force under unit torques, (1, n_drives, n)."""
        sample = self._lever_m * network.k_p
        spring = self._k.prod() / self._k.sum() + self._lever_m * sample
        drives = [sample] if self.alike else [sample, -sample * self._k[0] / self._k.sum()]
        return np.array([drives]) / spring
