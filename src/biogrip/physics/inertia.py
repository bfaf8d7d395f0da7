"""Modes of arms with inertia on a sample, which ring.

The denominator of both rotations is

    E = Z + 2 b^2 G    or    E = Z_2 Z_4 + (Z_2 + Z_4) b^2 G

for equal arms, or others (`biogrip.physics.response`). Times the product of all s + r_j it
is a polynomial, whose roots the iteration of `biogrip.physics.roots` finds. The iteration only
needs the quotient of the polynomial and its derivative, a sum over the branches. A root is kept as
its distance from the nearest branch, so that it has all digits where a branch is weak. Starts are
the rates without inertia, and the ringing of arms on a sample whose Maxwell dampers are rigid.
"""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.roots import Zeros, distances, find_zeros, spread_starts
from biogrip.physics.sample_model import Network

# Factor that moves starts off the real axis, which no iteration from a real start would leave.
_ASIDE = 1 + 1e-3j
# Relative distance to which equal rates of branches are moved apart; the response changes by as
# much.
_LEAST_GAP_OF_RATES = 1e-10
# Share of a branch's rate within which a root is lost in rounding.
_LEAST_GAP_OF_ROOTS = 1e-15


def ascending_branches(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return springs and rates of Maxwell branches, (n_branches, n); see `ascending`."""
    return ascending(network.k.T, (network.k / network.c).T)


def ascending(weights: NDArray[Any], rates: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return branches, (n_branches, n), ordered by their rates, equal rates moved apart."""
    order = np.argsort(rates.real, axis=0, kind="stable")
    weights, rates = (np.take_along_axis(of, order, axis=0) for of in (weights, rates))
    for slower, rate in pairwise(rates):
        rate += np.maximum((1 + _LEAST_GAP_OF_RATES) * slower.real - rate.real, 0)
    return weights, rates


class Ringing:
    """Modes of arms with inertia on n samples with any number of branches.

    Points are at -origin + beyond, (n, n_points): the origin is the rate of a branch, or zero. The
    zeros are the rates without inertia.
    """

    def __init__(self, gripper: Gripper, network: Network, zeros: Zeros) -> None:
        self._lever_m, self._b_2 = gripper.lever_m, gripper.lever_m**2
        self._alike = gripper.left == gripper.right
        self._arms = gripper.left, gripper.right
        left, right = (arm.inertia_kgm2 for arm in self._arms)
        self._highest = left if self._alike else left * right
        self._k_p, self._c_p = network.k_p[:, None], network.c_p[:, None]
        self._k, self._rates = (of.T[:, None] for of in ascending_branches(network))
        origin, beyond = self._begin(zeros)
        beyond = find_zeros(beyond, lambda points: self._newton_step(origin, points), origin)
        self.rates = s = beyond - origin
        """Roots of E in 1/s, (n, n_modes)."""
        away = (self._rates - origin[..., None]) + beyond[..., None]
        # From another start than that of its branch, a root may be found that is nearer to a very
        # weak branch than rounding. Its mode has no weight.
        lost = (np.abs(away) < _LEAST_GAP_OF_ROOTS * self._rates) & (
            self._rates != origin[..., None]
        )
        inverse = 1 / np.where(lost, _LEAST_GAP_OF_ROOTS**2 * self._rates, away)
        self._sample = self._k_p + self._c_p * s + (self._k * inverse).sum(axis=2) * s
        # dE/ds: the polynomial's, a product over root distances, over all s + r_j. Of roots that
        # nearly coincide it fits their distance.
        factors = distances(beyond, origin)
        factors[:, np.arange(s.shape[1]), np.arange(s.shape[1])] = 1
        factors[..., : inverse.shape[2]] *= inverse
        self._slope = self._highest * factors.prod(axis=2)

    def rotations(self) -> ComplexArray:
        """Return weights of the rotations in rad per N m, (n_arms, n_modes, n)."""
        if self._alike:
            return self._weights([np.ones_like(self.rates)] * 2)
        left, right = (_value(arm, self.rates) for arm in self._arms)
        return self._weights([right, left])

    def force(self) -> ComplexArray:
        """Return weights of the jaw force in N per N m, (1, n_modes, n)."""
        force = self._lever_m * self._sample
        if self._alike:
            return self._weights([2 * force])
        left, right = (_value(arm, self.rates) for arm in self._arms)
        return self._weights([force * (left + right)])

    def _weights(self, numerators: list[ComplexArray]) -> ComplexArray:
        weights: ComplexArray = np.array(numerators) / (self.rates * self._slope)
        return weights.swapaxes(1, 2)

    def _begin(self, zeros: Zeros) -> tuple[Array, ComplexArray]:
        """Return starts of the iteration: their origins, and distances beyond them."""
        branches = self._k.shape[2]
        ring = spread_starts(self._ring())
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
        terms = np.tile(arms, (len(spring_and_damper), 1))
        for power, of_power in enumerate(factor):
            terms[:, power : power + 2] += of_power * spring_and_damper
        return terms

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
