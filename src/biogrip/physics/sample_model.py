"""What a sample model is: its parameters, its network of springs and dampers, their drawing.

A stiffness is a load over a deformation, as N/m, Pa or N m/rad, or a pure number, without a name.
Names of units of dampings, compliances and columns follow from that of the stiffness.

In a drawing as text, what is parallel and what is in series is found from the network alone:

1. An element that makes the sample rigid when it is, is parallel to all else.
2. An element whose loss takes others out of the response is in series with these.
3. What takes none out is parallel to what goes with it in a branch.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, wraps
from math import inf
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array, IntArray


def per_second_of(unit: str) -> str:
    """Return the unit of a damping, a load over a rate: ``N s/m`` of ``N/m``, ``s`` of none."""
    above, slash, below = unit.partition("/")
    return f"{above} s".lstrip() + slash + below


def inverse_of(unit: str) -> str:
    """Return the unit of a compliance, or of a rate: ``1/(Pa s)`` of ``Pa s``, none of none."""
    above, _, below = unit.partition("/")
    return f"{below or 1}/({above})" if " " in above else f"{below or 1}/{above}" * bool(unit)


def suffix_of(unit: str) -> str:
    """Return the end of names of columns: ``_Ns_per_m`` of ``N s/m``, ``_Pa_s`` of ``Pa s``."""
    above, slash, below = unit.partition("/")
    if slash:
        return f"_{above.replace(' ', '')}_per_{below}"
    return f"_{above.replace(' ', '_')}" * bool(unit)


@dataclass(frozen=True)
class Network:
    """Springs and dampers of n samples."""

    k_p: Array
    """Parallel spring in N/m, (n,)."""
    c_p: Array
    """Parallel damper in N s/m, (n,)."""
    k: Array
    """Spring of each Maxwell branch in N/m, (n, n_branches)."""
    c: Array
    """Damper of each Maxwell branch in N s/m, (n, n_branches)."""


# Stiffness or damping of a rigid element, in N/m or N s/m, too large to affect a response.
_RIGID = 1e18


def of_columns(network: Callable[..., Network]) -> Callable[[ArrayLike], Network]:
    """Turn a function of columns, (n,), into one of (n, n_parameters), with inf made rigid."""

    @wraps(network)
    def of_parameters(parameters: ArrayLike) -> Network:
        columns = np.atleast_2d(np.asarray(parameters) * 1.0).T
        rigid = np.isinf(columns)
        return network(*(np.where(rigid, _RIGID, columns) if np.any(rigid) else columns))

    return of_parameters


def complex_modulus(network: Network, omega: Array) -> tuple[Array, Array]:
    """Return storage and loss moduli, each (n, n_omega) in N/m or Pa, at frequencies in rad/s."""
    rates = (network.k / network.c)[:, :, None]
    share = network.k[:, :, None] / (omega**2 + rates**2)
    storage = network.k_p[:, None] + np.sum(share * omega**2, axis=1)
    loss = network.c_p[:, None] * omega + np.sum(share * omega * rates, axis=1)
    return storage, loss


MOST_BRANCHES = 8
"""Most Maxwell branches of a generalized model."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a sample model."""

    name: str
    """Identifier in config, columns and code."""
    kind: str
    """``"stiffness"``, ``"damping"``, ``"springpot"`` (modulus at 1 rad/s) or ``"exponent"``."""
    meaning: str
    """A few words for tables."""
    range_name: str
    """Entry of the search range that holds for the parameter."""
    may_vanish: bool = False
    """True if zero is a possible value: the element is then absent."""
    below: float = inf
    """Upper bound of all values, if there is one."""
    stiffness: str = "N/m"
    """Unit of stiffnesses: N/m, Pa, N m/rad, or none if they are shares of another."""

    @property
    def unit(self) -> str:
        """SI unit; empty if it has none."""
        dimensions = {"damping": per_second_of(self.stiffness), "exponent": ""}
        return dimensions.get(self.kind, self.stiffness)

    @property
    def column(self) -> str:
        """Name of the parameter's column in result files."""
        return self.name + suffix_of(self.unit)

    @property
    def symbol(self) -> str:
        """The symbol as mathtext."""
        letter, _, index = re.sub("(alpha|beta)", r"\\\1", self.name).partition("_")
        return f"${letter}_{{{index}}}$" if index else f"${letter}$"


Turned: TypeAlias = Callable[..., tuple[Array | float, ...]]
"""Of the simpler model's parameters, one by one, those of the richer one."""


@dataclass(frozen=True)
class SampleModel:
    """A named constitutive model."""

    name: str
    """Name in the config."""
    title: str
    """Name in print."""
    parameters: tuple[Parameter, ...]
    """Parameters to identify, in the order of the columns of a population."""
    network: Callable[[ArrayLike], Network]
    """Turns parameters of shape (n, n_parameters) into a `Network`."""
    example: tuple[float, ...]
    """Parameters of some sample, which tests are about."""
    exchangeable: tuple[str, ...] = ()
    """Parameters that stiff branches make trade against each other: tables have their sum."""
    branches: tuple[tuple[str, str], ...] = ()
    """Spring and damper of each Maxwell branch, or modulus and exponent of each springpot, by
    name, where a trace is the same whichever is called which; in ascending order (`in_order`)."""
    contains: Mapping[str, Turned] = field(default_factory=dict, hash=False)
    """Models that it becomes where elements vanish, and how their parameters become its own."""

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in column order."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def stiffness_unit(self) -> str:
        """Unit of the stiffnesses of its elements."""
        return self.parameters[0].stiffness

    @property
    def power_law(self) -> bool:
        """True if it has a springpot, which stands for branches of all relaxation times."""
        return any(parameter.kind == "springpot" for parameter in self.parameters)

    @property
    def quantities(self) -> list[list[Parameter]]:
        """Rows of tables: every parameter, and the sum of the exchangeable ones."""
        exchangeable = [p for p in self.parameters if p.name in self.exchangeable]
        return [[p] for p in self.parameters] + ([exchangeable] if exchangeable else [])

    @property
    def free_branches(self) -> tuple[tuple[int, int], ...]:
        """Indices of both parameters of each branch of which both are to be identified."""
        places = {name: index for index, name in enumerate(self.names)}
        return tuple(
            (places[spring], places[damper])
            for spring, damper in self.branches
            if spring in places and damper in places
        )

    @property
    def branch_power(self) -> int:
        """Power of k in c/k^power, by which branches ascend: 0 for the exponents of springpots."""
        return 0 if self.power_law else 1

    def in_order(self, parameters: Array) -> IntArray:
        """Order in which branches of samples, (n, n_parameters), relax, the fastest first.

        A trace is the same whichever branch is called which; so that samples and fits can be
        compared, branches are counted by their relaxation times c/k, and springpots by their
        exponents. Returned is for every column the one that belongs there, as of
        `numpy.take_along_axis`.
        """
        order = np.tile(np.arange(len(self.names)), (len(parameters), 1))
        if len(self.free_branches) > 1:
            springs, dampers = np.array(self.free_branches).T
            times = parameters[:, dampers] / parameters[:, springs] ** self.branch_power
            ranks = np.argsort(times, axis=1, kind="stable")
            order[:, springs], order[:, dampers] = springs[ranks], dampers[ranks]
        return order

    def named_in_order(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Return a sample's parameters, by name, with its branches in their order."""
        values = np.array([[parameters[name] for name in self.names]])
        order = self.in_order(values)[0]
        return {**parameters, **dict(zip(self.names, values[0, order].tolist(), strict=True))}

    def moduli(self, parameters: Mapping[str, float], omega: Array) -> dict[str, Array]:
        """Return storage and loss moduli at frequencies in rad/s, (n_omega,), in named columns."""
        storage, loss = complex_modulus(self.sample(parameters), omega)
        suffix = suffix_of(self.stiffness_unit)
        return {"omega_per_s": omega, f"storage{suffix}": storage[0], f"loss{suffix}": loss[0]}

    def sample(self, parameters: Mapping[str, float]) -> Network:
        """Return the elements of the one sample that has these parameters, by name."""
        return self.network([[parameters[name] for name in self.names]])


def with_fixed(model: SampleModel, fixed: Mapping[str, float]) -> SampleModel:
    """Return the model with some parameters at known values, and only the others to identify."""
    return _with_known(model, tuple(fixed.items())) if fixed else model


@cache
def _with_known(model: SampleModel, fixed: tuple[tuple[str, float], ...]) -> SampleModel:
    known = {model.names.index(name): value for name, value in fixed if name in model.names}
    free = [index for index in range(len(model.names)) if index not in known]

    def network(parameters: ArrayLike) -> Network:
        given = np.atleast_2d(np.asarray(parameters) * 1.0)
        filled = np.empty((len(given), len(model.names)), given.dtype)
        filled[:, free], filled[:, list(known)] = given, list(known.values())
        return model.network(filled)

    return replace(
        model,
        parameters=tuple(model.parameters[index] for index in free),
        network=network,
        example=tuple(model.example[index] for index in free),
    )


@cache
def with_stiffness_unit(model: SampleModel, stiffness: str) -> SampleModel:
    """Return the model with stiffnesses in Pa, as of a sample under stress, or without a unit."""
    parameters = tuple(replace(parameter, stiffness=stiffness) for parameter in model.parameters)
    return replace(model, parameters=parameters)


K = Parameter("k", "stiffness", "Maxwell spring", "k")
K_P = Parameter("k_p", "stiffness", "parallel (membrane) spring", "k_p", may_vanish=True)
C = Parameter("c", "damping", "Maxwell damper", "c")
C_P = Parameter("c_p", "damping", "parallel damper", "c_p", may_vanish=True)

SINGLE_BRANCH: tuple[Parameter, ...] = (K, K_P, C, C_P)
"""The paper's parameters, which every file of identifications has columns for."""


_SIGNS = {"stiffness": "/\\/\\", "damping": "[==]", "springpot": "<>"}
# What an element is multiplied by to be gone, or rigid; a change that is none; where it is seen.
_TO_BE_GONE, _TO_BE_RIGID, _UNSEEN, _OMEGA = 1e-9, 1e9, 1e-4, np.array([0.03, 0.3, 3.0])


@cache
def sketched(model: SampleModel) -> str:
    r"""Return a model's elements in a line, as ``─k/\/\─c[==]─ ∥ ─k_p/\/\─`` of Zener's solid.

    Parallel parts are between bars. No parameter of the model is fixed.
    """
    signs = {p.name: f"{p.name}{_SIGNS[p.kind]}" for p in model.parameters if p.kind in _SIGNS}
    parts = []
    while signs:
        first = next(iter(signs))
        branch = [first, *_in_series_with(first, model)]
        chain = [name for name in branch if _in_series_with(name, model)] or branch
        beside = " ∥ ".join(signs[name] for name in branch if name not in chain)
        row = [signs[name] for name in chain] + [f"({beside})"] * bool(beside)
        parts.append(f"─{'─'.join(row)}─")
        signs = {name: sign for name, sign in signs.items() if name not in branch}
    return " ∥ ".join(parts)


def _in_series_with(element: str, model: SampleModel) -> list[str]:
    """Return the elements of which the response does not depend when one is gone."""
    if np.all(_modulus(model, {element: _TO_BE_RIGID}) > _TO_BE_RIGID**0.5):
        return []
    gone, size = _modulus(model, {element: _TO_BE_GONE}), _modulus(model, {})
    others = [p.name for p in model.parameters if p.kind in _SIGNS and p.name != element]
    changes = {name: _modulus(model, {element: _TO_BE_GONE, name: 2.0}) - gone for name in others}
    return [name for name, change in changes.items() if np.all(abs(change) < _UNSEEN * size)]


def _modulus(model: SampleModel, times: dict[str, float]) -> Array:
    """Return the dynamic modulus of the model's example with some elements multiplied, (n,)."""
    values = [times.get(n, 1.0) * x for n, x in zip(model.names, model.example, strict=True)]
    return np.hypot(*complex_modulus(model.network([values]), _OMEGA))[0]
