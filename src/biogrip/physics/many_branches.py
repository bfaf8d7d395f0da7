"""The linear model for samples of dozens of Maxwell branches, such as springpots.

Polynomials of such a degree are numerically useless. But without inertia the arms, seen from the
sample, have the impedance Z = Z_2 Z_4 / (Z_2 + Z_4), which is that of a spring, a damper and one
Maxwell branch. So with the sample's

    H = Z + b^2 G = A + B s + sum_j K_j s / (s + r_j)

is a sum of poles again, and the rates x of the modes interlace with the r_j
(`biogrip.physics.roots`). Where H is zero, b^2 G is -Z, so the numerators of

    phi_2 = [Z_4/(Z_2 + Z_4) tau_2 + b^2 G/(Z_2 + Z_4) (tau_2 - tau_4)] / H,

of phi_4 and of the jaw force follow from the arms alone. A mode of N/H has the weight -N/S with
S = A + sum_j K_j x^2/(x - r_j)^2, a sum of positive terms. Equal arms that are driven alike need no
branch of theirs: then 2 phi = tau/H.

With inertia, which targets have, the denominator of both rotations is

    E = Z + 2 b^2 G    or    E = Z_2 Z_4 + (Z_2 + Z_4) b^2 G

for arms that move alike, or do not. Times the product of all s + r_j it is a polynomial, whose
roots the iteration of `biogrip.physics.roots` finds. The iteration only needs the quotient of the
polynomial and its derivative, a sum over the branches. A root is kept as its distance from the
nearest branch, so that it has all digits where a branch is weak. Starts are the rates without
inertia, and the ringing of arms on a sample whose Maxwell dampers are rigid.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.roots import SMALLEST_GAP, Zeros, find_zeros, interlaced_zeros, roots
from biogrip.physics.sample_model import Network

# Least difference of the arms: the branch of equal arms has no effect, but a mode.
_LEAST_DIFFERENCE = 1e-30
# Factor that moves starts off the real axis, which no iteration from a real start would leave.
_ASIDE = 1 + 1e-3j
_ROUNDING = 1e-15


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
    arms = _Arms(gripper, alike=symmetric and gripper.left == gripper.right)
    impedance = arms.with_sample(network)
    zeros = interlaced_zeros(impedance.weights, impedance.rates, impedance.level)
    static = arms.forces_at_rest(network) if force else arms.rotations_at_rest(network)
    if inertia:
        found = _Ringing(gripper, network, zeros, alike=arms.alike)
        rates: NDArray[Any] = found.rates
        weights: NDArray[Any] = found.forces() if force else found.rotations()
    else:
        rates = np.ascontiguousarray(-zeros.values.T)
        numerators = arms.forces(zeros) if force else arms.rotations(zeros)[0]
        x, steepness = zeros.values, np.zeros_like(zeros.pole)
        for weight, rate in zip(impedance.weights, impedance.rates, strict=True):
            steepness += weight * (x / zeros.from_pole(rate)) ** 2
        weights = -numerators / steepness
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
    arms = _Arms(gripper, alike=symmetric and gripper.left == gripper.right)
    given = arms.with_sample(separated(network))
    parts = [
        of.reshape(*of.shape[:-1], count + 1, -1)
        for of in (given.weights, given.rates, given.level)
    ]
    impedance = _Impedance(*(of[..., 0, :].real for of in parts))
    # (n_parameters, n) of every weight and rate, and of the level.
    d_weights, d_rates, d_level = (of[..., 1:, :].imag / tilt for of in parts)
    zeros = interlaced_zeros(impedance.weights, impedance.rates, impedance.level)
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


@dataclass(frozen=True)
class _Impedance:
    """Impedance H = Z + b^2 G of n samples between the arms."""

    weights: NDArray[Any]
    """A and the K_j, (1 + n_rates, n); complex if the samples' elements are."""
    rates: NDArray[Any]
    """Zero and the r_j, ascending, (1 + n_rates, n)."""
    level: NDArray[Any]
    """B, (n,)."""


class _Arms:
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

    def with_sample(self, network: Network) -> _Impedance:
        """Return the impedance with a sample, its branches `separated`, between the arms."""
        b_2, k, c = self._lever_m**2, self._k, self._c
        weights, rates = b_2 * network.k.T, (network.k / network.c).T
        nothing = np.zeros((1, weights.shape[1]))
        if not self.alike:
            weights = np.concatenate((weights, nothing + self._chi**2 / k.sum()))
            rates = np.concatenate((rates, nothing + self._rate))
            weights, rates = _ascending(weights, rates)
        spring = k.prod() / k.sum() + b_2 * network.k_p
        return _Impedance(
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


class _Ringing:
    """Modes of arms with inertia on n samples with any number of branches.

    Points are at -origin + beyond, (n, n_points): the origin is the rate of a branch, or zero. The
    zeros are the rates without inertia; arms are alike if they are equal, and driven alike.
    """

    def __init__(self, gripper: Gripper, network: Network, zeros: Zeros, *, alike: bool) -> None:
        self._lever_m, self._b_2, self._alike = gripper.lever_m, gripper.lever_m**2, alike
        self._arms = gripper.left, gripper.right
        self._k_p, self._c_p = network.k_p[:, None], network.c_p[:, None]
        self._k, self._rates = network.k[:, None], (network.k / network.c)[:, None]
        origin, beyond = self._begin(zeros)
        between = origin[:, None] - origin[..., None]
        beyond = find_zeros(beyond, lambda points: self._newton_step(origin, points), between)
        self.rates = s = beyond - origin
        """Roots of E in 1/s, (n, n_modes)."""
        away = (self._rates - origin[..., None]) + beyond[..., None]
        # From another start than that of its branch, a root may be found that is nearer to a very
        # weak branch than rounding. Its mode has no weight.
        lost = (np.abs(away) < _ROUNDING * self._rates) & (self._rates != origin[..., None])
        inverse = 1 / np.where(lost, _ROUNDING**2 * self._rates, away)
        # G and dG/ds, and dE/ds.
        self._sample = self._k_p + self._c_p * s + (self._k * inverse).sum(axis=2) * s
        sample_slope = self._c_p + (self._k * self._rates * inverse**2).sum(axis=2)
        _, arms_slope, factor, factor_slope = self._of_arms(s)
        through = factor_slope * self._sample + factor * sample_slope
        self._slope = arms_slope + self._b_2 * through

    def rotations(self) -> ComplexArray:
        """Return weights of the rotations in rad per N m, (n_arms, n_drives, n_modes, n)."""
        if self._alike:
            return self._weights([[np.ones_like(self.rates)]] * 2)
        left, right = (_value(arm, self.rates) for arm in self._arms)
        sample = self._b_2 * self._sample
        return self._weights([[right, sample], [left, -(left + sample)]])

    def forces(self) -> ComplexArray:
        """Return weights of the jaw force in N per N m, (1, n_drives, n_modes, n)."""
        force = self._lever_m * self._sample
        if self._alike:
            return self._weights([[2 * force]])
        left, right = (_value(arm, self.rates) for arm in self._arms)
        return self._weights([[force * (left + right), -force * left]])

    def _weights(self, numerators: list[list[ComplexArray]]) -> ComplexArray:
        weights: ComplexArray = np.array(numerators) / (self.rates * self._slope)
        return weights.swapaxes(2, 3)

    def _begin(self, zeros: Zeros) -> tuple[Array, ComplexArray]:
        """Return starts of the iteration: their origins, and distances beyond them."""
        branches = self._k.shape[2]
        ring = roots(self._ring()) * _ASIDE
        origin = np.concatenate((zeros.pole[:branches].T, np.zeros(ring.shape)), axis=1)
        slow = -zeros.beyond[:branches].T * _ASIDE
        return origin, np.concatenate((slow, ring), axis=1)

    def _ring(self) -> Array:
        """Return E with a spring and a damper as sample, ascending powers, (n, terms)."""
        spring_and_damper = self._b_2 * np.concatenate(
            (self._k_p + self._k.sum(axis=2), self._c_p), axis=1
        )
        z_2, z_4 = (_polynomial(arm) for arm in self._arms)
        arms, factor = (z_2, np.array([2.0])) if self._alike else (np.convolve(z_2, z_4), z_2 + z_4)
        return np.array(
            [
                arms + np.pad(product, (0, len(arms) - len(product)))
                for product in (np.convolve(factor, of_one) for of_one in spring_and_damper)
            ]
        )

    def _newton_step(self, origin: Array, beyond: ComplexArray) -> ComplexArray:
        """Return the polynomial, E times all s + r_j, divided by its derivative."""
        s = beyond - origin
        away = (self._rates - origin[..., None]) + beyond[..., None]
        own = self._rates == origin[..., None]
        inverse = np.where(own, 0, 1 / away)
        arms, arms_slope, factor, factor_slope = self._of_arms(s)
        others = self._b_2 * (self._k_p + self._c_p * s + (self._k * inverse).sum(axis=2) * s)
        others_slope = self._b_2 * (self._c_p + (self._k * self._rates * inverse**2).sum(axis=2))
        value = arms + factor * others
        slope = arms_slope + factor_slope * others + factor * others_slope
        # At the origin of a branch: value and slope times s + r.
        spring = self._b_2 * np.where(own, self._k, 0).sum(axis=2)
        has_own = np.any(own, axis=2)
        whole = value + beyond * slope + spring * (factor_slope * s + factor)
        slope = np.where(has_own, whole, slope)
        value = np.where(has_own, beyond * value + spring * factor * s, value)
        return value / (slope + value * inverse.sum(axis=2))

    def _of_arms(
        self, s: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return the summand beside b^2 G, and the factor of b^2 G, each with its derivative."""
        (left, left_slope), (right, right_slope) = (
            (_value(arm, s), 2 * arm.inertia_kgm2 * s + arm.damping_Nms_per_rad)
            for arm in self._arms
        )
        if self._alike:
            return left, left_slope, np.full_like(s, 2), np.zeros_like(s)
        product_slope = left_slope * right + left * right_slope
        return left * right, product_slope, left + right, left_slope + right_slope


def _polynomial(arm: Arm) -> Array:
    return np.array([arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad, arm.inertia_kgm2])


def _value(arm: Arm, s: ComplexArray) -> ComplexArray:
    """Return the impedance of a free arm."""
    k, c, inertia = _polynomial(arm)
    return k + s * (c + s * inertia)
