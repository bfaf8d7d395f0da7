"""One sample as Maxwell branches and as Kelvin-Voigt elements; neither form uses biogrip."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from biogrip.arrays import Array


@dataclass(frozen=True)
class Maxwell:
    """A parallel spring beside Maxwell branches, E(t) = k_p + sum_j k_j exp(-t/tau_j).

    Parameters
    ----------
    k_p
        Parallel spring in N/m.
    k, tau : (n_branches,)
        Spring in N/m and relaxation time in s of each branch.
    """

    k_p: float
    k: Array
    tau: Array

    def modulus(self, time_s: Array) -> Array:
        """Force after a unit step of shortening in N/m, (n_samples,)."""
        relaxed: Array = self.k_p + self.k @ np.exp(-time_s / self.tau[:, None])
        return relaxed

    def compliance(self, time_s: Array) -> Array:
        """Shortening after a unit step of force in m/N, (n_samples,)."""
        return self.kelvin().compliance(time_s)

    def kelvin(self) -> "Kelvin":
        """Return the same sample as springs and Kelvin-Voigt elements in series."""
        shares = [self.k_p, *self.k]
        factors = [np.ones(1), *(np.array([1.0, tau]) for tau in self.tau)]
        spring, *branches = shares
        zeros = _product(factors)
        poles = spring * zeros
        for j, k in enumerate(branches, start=1):
            others = _product(factors[:j] + factors[j + 1 :])
            poles = polynomial.polyadd(poles, k * self.tau[j - 1] * np.array([0.0, *others]))
        final, weights, times = _step_response(zeros, poles)
        return Kelvin(final + float(weights.sum()), -weights, times)

    def ordered(self) -> "Maxwell":
        """Return the same sample, its branches by relaxation time."""
        order = np.argsort(self.tau)
        return Maxwell(self.k_p, self.k[order], self.tau[order])

    def named(self) -> dict[str, float]:
        """Parameters by name, branches by relaxation time."""
        own = self.ordered()
        return {
            "k_p": own.k_p,
            **{f"k_{j}": float(k) for j, k in enumerate(own.k, start=1)},
            **{f"tau_{j}": float(tau) for j, tau in enumerate(own.tau, start=1)},
        }


@dataclass(frozen=True)
class Kelvin:
    """A spring and Kelvin-Voigt elements in series, J(t) = J_0 + sum_j J_j (1 - exp(-t/T_j)).

    Parameters
    ----------
    instant
        Compliance of the spring, J_0, in m/N.
    share, time : (n_elements,)
        Compliance in m/N and retardation time in s of each element.
    """

    instant: float
    share: Array
    time: Array

    def compliance(self, time_s: Array) -> Array:
        """Shortening after a unit step of force in m/N, (n_samples,)."""
        crept: Array = self.instant - self.share @ np.expm1(-time_s / self.time[:, None])
        return crept

    def maxwell(self) -> Maxwell | None:
        """Return the same sample as Maxwell branches, if it can be had from springs and dampers."""
        if self.instant <= 0 or np.any(self.share <= 0) or np.any(self.time <= 0):
            return None
        factors = [np.array([1.0, time]) for time in self.time]
        zeros = _product(factors)
        poles = self.instant * zeros
        for j, share in enumerate(self.share):
            poles = polynomial.polyadd(poles, share * _product(factors[:j] + factors[j + 1 :]))
        return Maxwell(*_step_response(zeros, poles)).ordered()

    def named(self) -> dict[str, float]:
        """Parameters by name, elements by retardation time."""
        order = np.argsort(self.time)
        return {
            "J_0": self.instant,
            "J_inf": self.instant + float(self.share.sum()),
            **{f"J_{j}": float(share) for j, share in enumerate(self.share[order], start=1)},
            **{f"T_{j}": float(time) for j, time in enumerate(self.time[order], start=1)},
        }


def _product(factors: list[Array]) -> Array:
    product: Array = np.ones(1)
    for factor in factors:
        product = np.asarray(polynomial.polymul(product, factor), dtype=float)
    return product


def _step_response(numerator: Array, denominator: Array) -> tuple[float, Array, Array]:
    """Final value, and weights and times of the exponentials, of a ratio of polynomials in s."""
    roots = polynomial.polyroots(denominator).real
    slopes = polynomial.polyval(roots, polynomial.polyder(denominator))
    weights = polynomial.polyval(roots, numerator) / (roots * slopes)
    return float(numerator[0] / denominator[0]), weights, -1.0 / roots
