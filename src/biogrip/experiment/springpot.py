r"""The springpot, a power law between spring and damper, as a ladder of Maxwell branches.

Its force is V (t_0 d/dt)^alpha delta with t_0 = 1 s: that of a spring V for alpha = 0, of
a damper V t_0 for alpha = 1. In

    s^alpha = sin(pi alpha)/pi int_-inf^inf e^(alpha u) s / (s + e^u) du

the trapezoidal rule of step h [2] gives springs h sin(pi alpha)/pi e^(alpha u_j), each with a
damper in series. They relax at the rates e^(u_j), whatever alpha is. For the poles of
the integrand, at a distance of pi from the real axis if s is real and of pi/2 if it is
imaginary, the relative error is about e^(-2 pi^2/h) or 2 e^(-pi^2/h). Of the infinite
sum a band of rates is kept. All slower branches together are replaced by a spring and a
few branches, all faster ones by a damper and a few branches, which have the same first
moments: a quadrature on Chebyshev's nodes, one of them at zero. All springs come out
positive and smooth in alpha, and the limits, spring and damper, are exact.

References
----------
.. [1] A. Bonfanti, J. L. Kaplan, G. Charras and A. Kabla, Fractional viscoelastic models for
   power-law materials, Soft Matter 16 (2020), 6002-6020: springpots, and what they describe.
.. [2] L. N. Trefethen and J. A. C. Weideman, The exponentially convergent trapezoidal rule,
   SIAM Review 56 (2014), 385-458.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array

SHORTEST_S, LONGEST_S = 1e-5, 1e5
"""Range of times, and of reciprocal rates, in which the ladder is a springpot to 1e-6."""

_STEP, _WHOLE = 0.6, 45
_SLOWEST_PER_S = 0.5e-5
_NODES = 3

_RATES = _SLOWEST_PER_S * np.exp(_STEP * np.arange(_WHOLE))
# The first rate left out is e^-h times the last one kept; the nodes go a little beyond.
_PLACES = np.exp(-_STEP / 2) * (np.sin(np.pi * np.arange(_NODES + 1) / (2 * _NODES + 1)) ** 2)

BRANCH_RATES_PER_S: Array = np.concatenate(
    (_SLOWEST_PER_S * _PLACES[1:], _RATES, _RATES[-1] / _PLACES[:0:-1])
)
"""Rates at which the branches of every springpot relax, ascending."""


def _interpolation(places: Array) -> Array:
    """Return ascending coefficients of the Lagrange polynomials of some places."""
    rows = np.zeros((len(places), len(places)))
    rows[:, 0] = 1.0
    for row, place in zip(rows, places, strict=True):
        for other in places[places != place]:
            row[:] = (np.append(0.0, row[:-1]) - other * row) / (place - other)
    return rows


_TO_WEIGHTS = _interpolation(_PLACES)


_ROUNDING = 2.0**-44


@dataclass(frozen=True)
class Ladder:
    """Parallel spring, damper and Maxwell branches that represent n springpots."""

    spring: NDArray[Any]
    """Parallel spring in N/m, (n,)."""
    damper: NDArray[Any]
    """Parallel damper in N s/m, (n,)."""
    springs: NDArray[Any]
    """Springs of the Maxwell branches in N/m, (n_branches, n); their rates are
    `BRANCH_RATES_PER_S`."""


def ladder(modulus_N_per_m: NDArray[Any], exponent: NDArray[Any]) -> Ladder:
    """Return the springs and dampers that represent n springpots V (s t_0)^alpha.

    V is the modulus at 1 rad/s, alpha between 0 and 1. Both may be complex: the result is an
    analytic function.
    """
    # At 0 and 1, where tails would be infinite, the next exponent gives the same response.
    exponent = np.where(exponent == 0, _ROUNDING, exponent)
    exponent = np.where(exponent == 1, 1 - _ROUNDING, exponent)
    # sin(pi alpha), with all digits near one, too.
    near = np.where(np.real(exponent) > 0.5, 1 - exponent, exponent)
    density = modulus_N_per_m * _STEP * np.sin(np.pi * near) / np.pi
    springs = density * np.exp(exponent * np.log(_RATES)[:, None])
    slow = springs[0] * _tail(exponent)
    fast = springs[-1] * _tail(1 - exponent)
    within = (slow[1:], springs, fast[:0:-1] / _PLACES[:0:-1, None])
    return Ladder(slow[0], fast[0] / _RATES[-1], np.concatenate(within))


def _tail(exponent: NDArray[Any]) -> NDArray[Any]:
    """Return weights at the nodes with the moments of e^(-a j h), j = 1, 2, ..., at e^(-j h)."""
    powers = exponent + np.arange(_NODES + 1)[:, None]
    return np.einsum("mk,kn->mn", _TO_WEIGHTS, 1 / np.expm1(_STEP * powers))
