"""Fractional (power-law) models: springpots, alone and with springs, dampers or one another.

A springpot, between spring and damper, is a ladder of Maxwell branches. Its force is V (t_0
d/dt)^alpha delta with t_0 = 1 s: that of a spring V for alpha = 0, of a damper V t_0 for alpha = 1.
In

    s^alpha = sin(pi alpha)/pi int_-inf^inf e^(alpha u) s / (s + e^u) du

the trapezoidal rule of step h [2]_ gives springs h sin(pi alpha)/pi e^(alpha u_j), each with a
damper in series. They relax at the rates e^(u_j), whatever alpha is. By the poles of the integrand
the relative error is about e^(-2 pi^2/h) where s is real, and 2 e^(-pi^2/h) where it is imaginary.
Of the infinite sum a band of rates is kept. All slower branches are replaced by a spring and a few
branches, all faster ones by a damper and a few, which have the same first moments: a quadrature on
Chebyshev's nodes, one of them at zero. All springs come out positive and smooth in alpha, and the
limits, spring and damper, are exact.

Ladders have the same rates, so in parallel they add up. In series their impedance is L_1 L_2/H with
H = L_1 + L_2. It has branches at the zeros -x of H, with the springs L_1(-x)^2/(x H'(-x)), and, if
both ladders have branches, at the shared rates p_j, with the springs W_1j W_2j/(W_1j + W_2j).

`docs/models.md` has the networks and what they are for, [1]_ how they creep and relax.

References
----------
.. [1] A. Bonfanti et al., Soft Matter 16 (2020), 6002-6020: springpots, in closed form.
.. [2] L. N. Trefethen and J. A. C. Weideman, SIAM Review 56 (2014), 385-458: trapezoidal rule.
"""

from dataclasses import dataclass, replace
from functools import cache
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from biogrip.arrays import Array
from biogrip.physics.roots import Zeros, interlaced_zeros
from biogrip.physics.sample_model import C_P, K_P, C, K, Network, Parameter, SampleModel, of_columns

SHORTEST_S, LONGEST_S = 1e-5, 1e5
"""Range of times, and of reciprocal rates, in which the ladder is a springpot to 1e-6."""

_LADDER_STEP, _LADDER_RATES = 0.6, 45
_SLOWEST_PER_S = 0.5e-5
_ENDS = 3

_RATES = _SLOWEST_PER_S * np.exp(_LADDER_STEP * np.arange(_LADDER_RATES))
# The first rate left out is e^-h times the last one kept; the nodes go a little beyond.
_END_PLACES = np.exp(-_LADDER_STEP / 2) * (
    np.sin(np.pi * np.arange(_ENDS + 1) / (2 * _ENDS + 1)) ** 2
)

BRANCH_RATES_PER_S: Array = np.concatenate(
    (_SLOWEST_PER_S * _END_PLACES[1:], _RATES, _RATES[-1] / _END_PLACES[:0:-1])
)
"""Rates at which the branches of every springpot relax, ascending."""


# Ascending coefficients of the Lagrange polynomials of the places.
_TO_WEIGHTS = np.linalg.inv(np.vander(_END_PLACES, increasing=True)).T

_NEXT_TO_SPRING = 2.0**-44
# Spring of a branch that equal ladders in series do not have, in N/m: no response shows it.
_SPRING_OF_EQUAL_LADDERS = 1e-30
# Least relative distance of the rates of two springpots in series.
_LEAST_GAP_OF_LADDERS = 2e-6


@dataclass(frozen=True)
class Ladder:
    """Parallel spring, damper and Maxwell branches of n samples."""

    spring: NDArray[Any]
    """Parallel spring in N/m, (n,)."""
    damper: NDArray[Any]
    """Parallel damper in N s/m, (n,)."""
    springs: NDArray[Any]
    """Springs in N/m of branches with `BRANCH_RATES_PER_S`, (n_branches, n), or zeros, (1, n)."""

    def __add__(self, other: "Ladder") -> "Ladder":
        """Return both ladders in parallel."""
        return Ladder(
            self.spring + other.spring, self.damper + other.damper, self.springs + other.springs
        )

    @property
    def network(self) -> Network:
        """Springs and dampers of the samples; the ladder has branches."""
        dampers = self.springs / BRANCH_RATES_PER_S[:, None]
        return Network(k_p=self.spring, c_p=self.damper, k=self.springs.T, c=dampers.T)

    @property
    def weights(self) -> NDArray[Any]:
        """Parallel spring and springs of the branches, (1 + n_branches, n)."""
        return np.concatenate((self.spring[None], self.springs))

    def near(self, zeros: Zeros) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return L(-x)/x and -d(L(-x)/x)/dx at positive numbers x, each (n_zeros, n)."""
        value, steepness = -self.damper + np.zeros_like(zeros.beyond), np.zeros_like(zeros.beyond)
        for weight, pole in zip(self.weights, _POLES, strict=False):
            distance = zeros.from_pole(pole)
            value = value + weight / distance
            steepness = steepness + weight / distance**2
        return value, steepness


_POLES = np.append(0.0, BRANCH_RATES_PER_S)


def spring(k: NDArray[Any]) -> Ladder:
    """Return n springs as ladders."""
    return Ladder(k, 0 * k, 0 * k[None])


def damper(c: NDArray[Any]) -> Ladder:
    """Return n dampers as ladders."""
    return Ladder(0 * c, c, 0 * c[None])


def in_series(first: Ladder, second: Ladder) -> Network:
    """Return the network of ladders in series; one of the two has branches."""
    both = first + second
    poles = _POLES[:, None] * np.ones(len(both.spring))
    zeros = interlaced_zeros(both.weights, poles, both.damper)
    (of_first, steep_first), (of_second, steep_second) = first.near(zeros), second.near(zeros)
    steepness = steep_first + steep_second
    # L_1 = -L_2 at the zeros. Of this mean no digits cancel that the softer ladder has.
    share = steep_first / steepness
    springs = ((1 - share) * of_first - share * of_second) ** 2 / steepness
    rates = zeros.values
    if np.all(product := first.springs * second.springs):
        springs = np.where(springs == 0, _SPRING_OF_EQUAL_LADDERS, springs)
        shared, at_zeros = product / both.springs, springs[1:]
        # Rates that are nearly equal cost digits: apart, with the same mean, they do not.
        lack = np.maximum(_LEAST_GAP_OF_LADDERS * poles[1:] - (rates[1:] - poles[1:]).real, 0)
        share = shared / (shared + at_zeros)
        rates[1:] += lack * share
        rates = np.concatenate((rates, poles[1:] - lack * (1 - share)))
        springs = np.concatenate((springs, shared))
    return Network(
        k_p=first.spring * second.spring / both.spring,
        c_p=first.damper * second.damper / both.damper,
        k=springs.T,
        c=(springs / rates).T,
    )


def ladder(modulus_N_per_m: NDArray[Any], exponent: NDArray[Any]) -> Ladder:
    """Return the springs and dampers that represent n springpots V (s t_0)^alpha.

    V is the modulus at 1 rad/s, alpha between 0 and 1. Both may be complex: the result is an
    analytic function.
    """
    # At 0 and 1, where tails would be infinite, the next exponent gives the same response.
    exponent = np.where(exponent == 0, _NEXT_TO_SPRING, exponent)
    exponent = np.where(exponent == 1, 1 - _NEXT_TO_SPRING, exponent)
    # sin(pi alpha), with all digits near one, too.
    near = np.where(np.real(exponent) > 0.5, 1 - exponent, exponent)
    density = modulus_N_per_m * _LADDER_STEP * np.sin(np.pi * near) / np.pi
    springs = density * np.exp(exponent * np.log(_RATES)[:, None])
    slow = springs[0] * _tail(exponent)
    fast = springs[-1] * _tail(1 - exponent)
    within = (slow[1:], springs, fast[:0:-1] / _END_PLACES[:0:-1, None])
    return Ladder(slow[0], fast[0] / _RATES[-1], np.concatenate(within))


def _tail(exponent: NDArray[Any]) -> NDArray[Any]:
    """Return weights at the nodes with the moments of e^(-a j h), j = 1, 2, ..., at e^(-j h)."""
    powers = exponent + np.arange(_ENDS + 1)[:, None]
    return np.einsum("mk,kn->mn", _TO_WEIGHTS, 1 / np.expm1(_LADDER_STEP * powers))


def _liquid(k_alpha: Array, alpha: Array, c: Array) -> Network:
    return in_series(damper(c), ladder(k_alpha, alpha))


def _gel(k: Array, k_alpha: Array, alpha: Array) -> Network:
    return in_series(spring(k), ladder(k_alpha, alpha))


def _beside(network: Network, k_p: Array | float = 0.0, c_p: Array | float = 0.0) -> Network:
    """Return a network with a spring or a damper beside it."""
    return replace(network, k_p=network.k_p + k_p, c_p=network.c_p + c_p)


@cache
def on_clock(model: SampleModel, unit_s: float) -> SampleModel:
    """Return the model with ladders that are springpots from 1e-5 to 1e5 of a unit of time."""
    if not model.power_law or unit_s == 1:
        return model
    kinds = [parameter.kind for parameter in model.parameters]

    def network(parameters: ArrayLike) -> Network:
        columns = np.array(parameters).T
        for place, kind in enumerate(kinds):
            if kind in ("springpot", "damping"):
                power = columns[place + 1] if kind == "springpot" else 1.0
                columns[place] = columns[place] / unit_s**power
        in_units = model.network(columns.T)
        return replace(in_units, c_p=in_units.c_p * unit_s, c=in_units.c * unit_s)

    return replace(model, network=network)


_K_ALPHA = Parameter("k_alpha", "springpot", "springpot, modulus at 1 rad/s", "k")
_ALPHA = Parameter("alpha", "exponent", "exponent of the springpot", "alpha", below=1.0)
_K_BESIDE = replace(K_P, meaning="parallel spring")
_C_BEHIND = replace(C, meaning="series damper")
_ONE = (_K_ALPHA, _ALPHA)
_TWO = (
    *_ONE,
    replace(_K_ALPHA, name="k_beta", meaning="other springpot, modulus at 1 rad/s"),
    replace(_ALPHA, name="beta", meaning="exponent of the other springpot, below alpha"),
)
_SPRINGPOTS_IN_ORDER = (("k_beta", "beta"), ("k_alpha", "alpha"))

FRACTIONAL_MODELS = (
    SampleModel(
        "springpot",
        "springpot",
        _ONE,
        of_columns(lambda k_alpha, alpha: ladder(k_alpha, alpha).network),
        example=(10.0, 0.4),
        contains={"damper": lambda c_p: (c_p, 1.0)},
    ),
    SampleModel(
        "fractional_kelvin_voigt",
        "fractional Kelvin-Voigt solid",
        (_K_BESIDE, *_ONE),
        of_columns(lambda k_p, k_alpha, alpha: (ladder(k_alpha, alpha) + spring(k_p)).network),
        example=(0.3, 10.0, 0.4),
        contains={
            "kelvin_voigt": lambda k_p, c_p: (k_p, c_p, 1.0),
            "springpot": lambda k_alpha, alpha: (0.0, k_alpha, alpha),
        },
    ),
    SampleModel(
        "springpot_beside_damper",
        "springpot and damper in parallel",
        (*_ONE, C_P),
        of_columns(lambda k_alpha, alpha, c_p: (ladder(k_alpha, alpha) + damper(c_p)).network),
        example=(10.0, 0.3, 20.0),
        contains={
            "springpot": lambda k_alpha, alpha: (k_alpha, alpha, 0.0),
            "kelvin_voigt": lambda k_p, c_p: (k_p, 0.0, c_p),
        },
    ),
    SampleModel(
        "springpots_in_parallel",
        "two springpots in parallel",
        _TWO,
        of_columns(lambda *both: (ladder(*both[:2]) + ladder(*both[2:])).network),
        example=(20.0, 0.8, 5.0, 0.2),
        branches=_SPRINGPOTS_IN_ORDER,
        contains={
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_alpha, alpha, k_p, 0.0),
            "springpot_beside_damper": lambda k_alpha, alpha, c_p: (c_p, 1.0, k_alpha, alpha),
        },
    ),
    SampleModel(
        "fractional_maxwell",
        "fractional Maxwell liquid",
        (*_ONE, _C_BEHIND),
        of_columns(_liquid),
        example=(10.0, 0.3, 300.0),
        contains={
            "maxwell": lambda k, c: (k, 0.0, c),
            "springpot": lambda k_alpha, alpha: (k_alpha, alpha, inf),
        },
    ),
    SampleModel(
        "fractional_maxwell_gel",
        "fractional Maxwell gel",
        (replace(K, meaning="series spring"), *_ONE),
        of_columns(_gel),
        example=(8.0, 20.0, 0.4),
        contains={
            "maxwell": lambda k, c: (k, c, 1.0),
            "springpot": lambda k_alpha, alpha: (inf, k_alpha, alpha),
        },
    ),
    SampleModel(
        "springpots_in_series",
        "two springpots in series",
        _TWO,
        of_columns(lambda *both: in_series(ladder(*both[:2]), ladder(*both[2:]))),
        example=(60.0, 0.8, 10.0, 0.2),
        branches=_SPRINGPOTS_IN_ORDER,
        contains={
            "fractional_maxwell": lambda k_alpha, alpha, c: (c, 1.0, k_alpha, alpha),
            "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k_alpha, alpha, k, 0.0),
        },
    ),
    SampleModel(
        "fractional_zener",
        "fractional Zener solid",
        (replace(K, meaning="series spring"), _K_BESIDE, *_ONE),
        of_columns(lambda k, k_p, *pot: _beside(_gel(k, *pot), k_p=k_p)),
        example=(8.0, 1.0, 20.0, 0.4),
        contains={
            "zener_maxwell": lambda k, k_p, c: (k, k_p, c, 1.0),
            "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k, 0.0, k_alpha, alpha),
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (inf, k_p, k_alpha, alpha),
        },
    ),
    SampleModel(
        "fractional_solid",
        "fractional Maxwell liquid and spring in parallel",
        (_K_BESIDE, *_ONE, _C_BEHIND),
        of_columns(lambda k_p, *liquid: _beside(_liquid(*liquid), k_p=k_p)),
        example=(1.0, 10.0, 0.3, 300.0),
        contains={
            "zener_maxwell": lambda k, k_p, c: (k_p, k, 0.0, c),
            "fractional_maxwell": lambda k_alpha, alpha, c: (0.0, k_alpha, alpha, c),
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_p, k_alpha, alpha, inf),
        },
    ),
    SampleModel(
        "fractional_jeffreys",
        "fractional Jeffreys liquid",
        (*_ONE, _C_BEHIND, C_P),
        of_columns(lambda *both: _beside(_liquid(*both[:3]), c_p=both[3])),
        example=(10.0, 0.3, 300.0, 20.0),
        contains={
            "fractional_maxwell": lambda k_alpha, alpha, c: (k_alpha, alpha, c, 0.0),
            "springpot_beside_damper": lambda k_alpha, alpha, c_p: (k_alpha, alpha, inf, c_p),
        },
    ),
)
