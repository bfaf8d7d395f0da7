"""Nested sample models: limits in which a model becomes a simpler one.

A model becomes a simpler one if an element vanishes: a parallel spring or damper of zero, one
in series at infinity; a springpot is a spring at an exponent of zero, and a damper at one. The
simpler model's parameters are converted to those of the richer one, zeros and infinities among
them (`biogrip.experiment.sample` gives such samples the same response).
"""

from collections.abc import Callable, Collection, Mapping
from functools import cache
from typing import TypeAlias

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.network import MOST_BRANCHES
from biogrip.experiment.sample import burgers

Turned: TypeAlias = Callable[..., tuple[Array | float, ...]]
"""Function from the simpler model's parameters, one by one, to the richer model's."""

INF = np.inf


def _to_kelvin(k: Array, k_p: Array, c: Array) -> tuple[Array, ...]:
    """Convert a Zener solid from Maxwell's form, k and c beside k_p, to Kelvin's."""
    share = k_p / k
    return k + k_p, k_p * (1 + share), c * (1 + share) ** 2


def _to_maxwell(k_s: Array, k_v: Array, c_v: Array) -> tuple[Array, ...]:
    """Convert a Zener solid from Kelvin's form to Maxwell's."""
    share = 1 / (1 + k_v / k_s)
    return share * k_s, share * k_v, share**2 * c_v


def _two_branches(*parameters: Array) -> tuple[Array | float, ...]:
    network = burgers(np.array([parameters]))
    (k_1, k_2), (c_1, c_2) = network.k[0], network.c[0]
    return k_1, k_2, 0.0, c_1, c_2, 0.0


def _one_branch_more(*parameters: Array) -> tuple[Array | float, ...]:
    half = len(parameters) // 2
    springs, dampers = parameters[: half - 1], parameters[half:-1]
    return *springs, 0.0, parameters[half - 1], *dampers, 0.0, parameters[-1]


def _same(*parameters: Array) -> tuple[Array, ...]:
    return parameters


_IN_A_DROP: dict[str, Turned] = {
    "maxwell": lambda k, c: (k, 0.0, c),
    "kelvin_voigt": lambda k_p, c_p: (INF, k_p, c_p),
    "zener_kelvin": _to_maxwell,
}

_DIRECTLY: dict[str, dict[str, Turned]] = {
    "maxwell": {"damper": lambda c_p: (INF, c_p)},
    "kelvin_voigt": {"damper": lambda c_p: (0.0, c_p)},
    "fractional_kelvin_voigt": {"kelvin_voigt": lambda k_p, c_p: (k_p, c_p, 1.0)},
    "fractional_maxwell": {"maxwell": lambda k, c: (k, 0.0, c)},
    "liquid_drop": {"zener_maxwell": _same, **_IN_A_DROP},
    "zener_maxwell": {"liquid_drop": _same, **_IN_A_DROP},
    "zener_kelvin": {
        "liquid_drop": _to_kelvin,
        "maxwell": lambda k, c: (k, 0.0, c),
        "kelvin_voigt": lambda k_p, c_p: (INF, k_p, c_p),
    },
    "generalized_maxwell": {
        "liquid_drop": lambda k, k_p, c: (k, k_p, c, 0.0),
        "kelvin_voigt": lambda k_p, c_p: (0.0, k_p, 0.0, c_p),
    },
    "burgers": {
        "maxwell": lambda k, c: (k, c, INF, INF),
        "zener_kelvin": lambda k_s, k_v, c_v: (k_s, INF, k_v, c_v),
    },
    "generalized_maxwell_2": {
        "generalized_maxwell": _one_branch_more,
        "burgers": _two_branches,
    },
    **{
        f"generalized_maxwell_{n}": {
            "generalized_maxwell" + (f"_{n - 1}" if n > 2 else ""): _one_branch_more
        }
        for n in range(3, MOST_BRANCHES + 1)
    },
}
# By candidate, the candidates nested in it directly; those nested in these are nested in it, too.

Way: TypeAlias = tuple[Turned, ...]
"""Conversions of parameters, from one model to the next."""


@cache
def contained(candidate: str) -> Mapping[str, Way]:
    """Return the candidates nested in one, each with the shortest way of conversions to it."""
    found: dict[str, Way] = {candidate: ()}
    ahead = [candidate]
    for richer in ahead:
        for name, turned in _DIRECTLY.get(richer, {}).items():
            if name not in found:
                found[name] = (turned, *found[richer])
                ahead.append(name)
    del found[candidate]
    return found


def contained_in(candidate: str, others: Collection[str]) -> list[str]:
    """Return the names of those candidates among `others` that are nested in one."""
    return [name for name in contained(candidate) if name in others]


def different_in(candidate: str, others: Collection[str]) -> list[str]:
    """Return the same names, with only one of models that are equivalent in other parameters."""
    found: list[str] = []
    for name in contained_in(candidate, others):
        if not any(name in contained(other) and other in contained(name) for other in found):
            found.append(name)
    return found


def as_richer(candidate: str, simpler: str, parameters: Array) -> Array:
    """Convert a nested model's parameters, (n_parameters,), to those of a richer model."""
    with np.errstate(invalid="ignore", divide="ignore"):
        for turned in contained(candidate)[simpler]:
            parameters = np.array(turned(*parameters), dtype=float)
    return parameters
