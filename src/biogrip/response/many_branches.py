"""The linear model without inertia, for samples of dozens of Maxwell branches.

Polynomials of such a degree are numerically useless. But the arms, seen from the sample,
have the impedance Z = Z_2 Z_4 / (Z_2 + Z_4), which is that of a spring, a damper and one
Maxwell branch. So with the sample's

    H = Z + b^2 G = A + B s + sum_j K_j s / (s + r_j)

is a sum of poles again, and the rates x of the modes interlace with the r_j
(`biogrip.interlacing`). Where H is zero, b^2 G is -Z, so the numerators of

    phi_2 = [Z_4/(Z_2 + Z_4) tau_2 + b^2 G/(Z_2 + Z_4) (tau_2 - tau_4)] / H,

of phi_4 and of the jaw force follow from the arms alone. A mode of N/H has the weight
-N/S with S = A + sum_j K_j x^2/(x - r_j)^2, a sum of positive terms. Equal arms that are
driven alike need no branch of theirs: then 2 phi = tau/H.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array
from biogrip.experiment.network import Network
from biogrip.instrument.gripper import Gripper
from biogrip.interlacing import Zeros, interlaced_zeros
from biogrip.response.many_branches_ringing import Ringing
from biogrip.response.roots import SMALLEST_GAP

# Least difference of the arms: the branch of equal arms has no effect, but a mode.
_LEAST_DIFFERENCE = 1e-30


@dataclass(frozen=True)
class Impedance:
    """Impedance H = Z + b^2 G of n samples between the arms."""

    weights: NDArray[Any]
    """A and the K_j, (1 + n_rates, n); complex if the samples' elements are."""
    rates: NDArray[Any]
    """Zero and the r_j, ascending, (1 + n_rates, n)."""
    level: NDArray[Any]
    """B, (n,)."""

    def zeros(self) -> Zeros:
        """Return the rates of the modes; elements must be real."""
        return interlaced_zeros(self.weights, self.rates, self.level)

    def steepness(self, zeros: Zeros) -> Array:
        """Return S of each mode, (n_modes, n)."""
        x = zeros.values
        total = np.zeros_like(x)
        for weight, rate in zip(self.weights, self.rates, strict=True):
            total += weight * (x / zeros.from_pole(rate)) ** 2
        return total


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
        """Return the impedance with a sample, its branches `separated`, between the arms."""
        b_2, k, c = self._lever_m**2, self._k, self._c
        weights, rates = b_2 * network.k.T, (network.k / network.c).T
        nothing = np.zeros((1, weights.shape[1]))
        if not self.alike:
            weights = np.concatenate((weights, nothing + self._chi**2 / k.sum()))
            rates = np.concatenate((rates, nothing + self._rate))
            weights, rates = _ascending(weights, rates)
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


def separated(network: Network) -> Network:
    """Return the same samples with branches ordered by their rates, equal rates moved apart."""
    springs, rates = _ascending(network.k.T, (network.k / network.c).T)
    return replace(network, k=springs.T, c=(springs / rates).T)


def _ascending(weights: NDArray[Any], rates: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    order = np.argsort(rates.real, axis=0, kind="stable")
    weights, rates = (np.take_along_axis(of, order, axis=0) for of in (weights, rates))
    for slower, rate in pairwise(rates):
        rate += np.maximum((1 + SMALLEST_GAP) * slower.real - rate.real, 0)
    return weights, rates


def modes_of_many(
    gripper: Gripper, network: Network, *, symmetric: bool, inertia: bool, force: bool = False
) -> tuple[Array, NDArray[Any], NDArray[Any]]:
    """Compute step responses of both arms, or of the jaw force: constants, rates and weights.

    Arguments are those of `step_response`, with n samples of more than `MOST_BRANCHES` branches;
    with `force`, the jaw force in N takes the place of the arms' rotations.

    Returns
    -------
    static : (n, n_arms, n_drives)
        In rad (N) per N m.
    rates : (n, n_modes)
    weights : (n, n_arms, n_drives, n_modes)
        In rad (N) per N m.
    """
    network = separated(network)
    arms = Arms(gripper, alike=symmetric and gripper.left == gripper.right)
    impedance = arms.with_sample(network)
    zeros = impedance.zeros()
    static = arms.forces_at_rest(network) if force else arms.rotations_at_rest(network)
    if inertia:
        found = Ringing(gripper, network, zeros, alike=arms.alike)
        rates: NDArray[Any] = found.rates
        weights: NDArray[Any] = found.forces() if force else found.rotations()
    else:
        rates = np.ascontiguousarray(-zeros.values.T)
        numerators = arms.forces(zeros) if force else arms.rotations(zeros)[0]
        weights = -numerators / impedance.steepness(zeros)
    drives = slice(1 if symmetric else 2)
    static, weights = (np.moveaxis(of[:, drives], -1, 0) for of in (static, weights))
    return np.ascontiguousarray(static), rates, np.ascontiguousarray(weights)


def modes_with_slopes(
    gripper: Gripper, network: Network, tilt: float, count: int, *, symmetric: bool
) -> tuple[Array, Array, Array, Array]:
    """Compute rates and weights of the left arm, with derivatives by the log-parameters.

    With H(x; p) = 0 at a rate, dx = (sum_j dK_j/(x - r_j) + ...) / (S/x^2); S and N follow. The
    network has n samples, and after them the same with each of `count` parameters tilted into the
    complex plane by the share `tilt`.

    Returns
    -------
    rates : (n_modes, n)
    weights : (n_drives, n_modes, n)
    rate_slopes : (n_parameters, n_modes, n)
    weight_slopes : (n_parameters, n_drives, n_modes, n)
    """
    arms = Arms(gripper, alike=symmetric and gripper.left == gripper.right)
    given = arms.with_sample(separated(network))
    parts = [
        of.reshape(*of.shape[:-1], count + 1, -1)
        for of in (given.weights, given.rates, given.level)
    ]
    impedance = Impedance(*(of[..., 0, :].real for of in parts))
    # (n_parameters, n) of every weight and rate, and of the level.
    d_weights, d_rates, d_level = (of[..., 1:, :].imag / tilt for of in parts)
    zeros = impedance.zeros()
    x = zeros.values
    moved = np.zeros((count, *x.shape)) - d_level[:, None]
    steepness = np.zeros_like(x)
    branches = list(zip(impedance.weights, impedance.rates, d_weights, d_rates, strict=True))
    for weight, rate, d_weight, d_rate in branches:
        inverse = 1 / zeros.from_pole(rate)
        steepness += weight * (x * inverse) ** 2
        moved += d_weight[:, None] * inverse
        if np.any(d_rate):
            moved += (weight * d_rate)[:, None] * (inverse * inverse)
    moved *= x * x / steepness
    steepening = np.zeros_like(moved)
    for weight, rate, d_weight, d_rate in branches:
        inverse = 1 / zeros.from_pole(rate)
        ratio = x * inverse
        away = 2 * weight * rate * ratio * inverse * inverse
        steepening += d_weight[:, None] * (ratio * ratio) - moved * away
        if np.any(d_rate):
            steepening += d_rate[:, None] * (2 * weight * (ratio * inverse) * ratio)
    drives = slice(1 if symmetric else 2)
    numerators, slopes = (of[0, drives] for of in arms.rotations(zeros))
    weights = -numerators / steepness
    weight_slopes = -(slopes * moved[:, None] + weights * steepening[:, None]) / steepness
    return -x, weights, -moved, weight_slopes
