"""Constitutive models of the sample: spring-dashpot networks between the two jaws (Figure 5).

Every network is a parallel spring k_p and damper c_p beside any number of
Maxwell branches (a spring k and a damper c in series). Its force follows the
shortening delta of the sample as

    F(s) = [k_p + c_p s + sum_j k_j c_j s / (k_j + c_j s)] delta(s)

A model is one entry of `MODELS`; genome, tables and figures follow from it. Its
network is made by arithmetic alone, so that parameters with a small imaginary
part carry derivatives through it (`biogrip.response.sensitivity`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array, IntArray
from biogrip.experiment.fractional import fractional_kelvin_voigt, fractional_maxwell
from biogrip.experiment.network import MOST_BRANCHES as MOST_BRANCHES
from biogrip.experiment.network import Network as Network
from biogrip.experiment.network import columns_of

_UNITS = {"stiffness": "N/m", "damping": "N s/m", "springpot": "N/m", "exponent": ""}
_SUFFIXES = {
    "stiffness": "_N_per_m",
    "damping": "_Ns_per_m",
    "springpot": "_N_per_m",
    "exponent": "",
}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a sample model.

    Parameters
    ----------
    name
        Identifier in config, columns and code.
    kind
        ``"stiffness"``, ``"damping"``, ``"springpot"`` (a modulus at 1 rad/s) or
        ``"exponent"``; decides the unit.
    meaning
        A few words for tables.
    range_name
        Entry of the search ranges that holds for it.
    may_vanish
        True if zero is a possible value: the element is then absent.
    below
        Upper bound of its values, exclusive.
    """

    name: str
    kind: str
    meaning: str
    range_name: str
    may_vanish: bool = False
    below: float = inf

    @property
    def unit(self) -> str:
        """SI unit; empty if it has none."""
        return _UNITS[self.kind]

    @property
    def column(self) -> str:
        """Name of the parameter's column in result files."""
        return self.name + _SUFFIXES[self.kind]

    @property
    def symbol(self) -> str:
        """The symbol as mathtext."""
        letter, _, index = self.name.replace("alpha", r"\alpha").partition("_")
        return f"${letter}_{{{index}}}$" if index else f"${letter}$"


@dataclass(frozen=True)
class SampleModel:
    """A named constitutive model.

    Parameters
    ----------
    name, title
        Name in the config; name in print.
    parameters
        Parameters to identify, in the order of the columns of a population.
    network
        Function from parameters of shape (n, n_parameters) to a `Network`.
    exchangeable
        Parameters whose sum has a row of its own in tables, because with stiff branches
        only the sum is determined.
    branches
        Spring and damper of each Maxwell branch, by name; with several, the fastest first.
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    network: Callable[[ArrayLike], Network]
    exchangeable: tuple[str, ...] = ()
    branches: tuple[tuple[str, str], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in column order."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def power_law(self) -> bool:
        """True if the model has a springpot, which is represented by many branches."""
        return any(parameter.kind == "springpot" for parameter in self.parameters)

    @property
    def quantities(self) -> list[list[Parameter]]:
        """Rows of tables: every parameter, and the sum of the exchangeable ones."""
        together = [p for p in self.parameters if p.name in self.exchangeable]
        return [[p] for p in self.parameters] + ([together] if together else [])

    @property
    def free_branches(self) -> tuple[tuple[int, int], ...]:
        """Indices of spring and damper of each branch whose spring and damper are both free."""
        places = {name: index for index, name in enumerate(self.names)}
        return tuple(
            (places[spring], places[damper])
            for spring, damper in self.branches
            if spring in places and damper in places
        )

    def in_order(self, parameters: Array) -> IntArray:
        """Return the column order that sorts branches by relaxation time, the fastest first.

        Exchanging branches does not change a trace. For comparison of samples and fits,
        branches are counted in the order of their relaxation times c/k.

        Parameters
        ----------
        parameters : (n, n_parameters)
            Parameters of n samples.

        Returns
        -------
        (n, n_parameters)
            Indices of the columns, for `numpy.take_along_axis`.
        """
        order = np.tile(np.arange(len(self.names)), (len(parameters), 1))
        if len(self.free_branches) > 1:
            springs, dampers = np.array(self.free_branches).T
            times = parameters[:, dampers] / parameters[:, springs]
            ranks = np.argsort(times, axis=1, kind="stable")
            order[:, springs], order[:, dampers] = springs[ranks], dampers[ranks]
        return order

    def named_in_order(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Return a sample's parameters by name, with branches sorted by relaxation time."""
        values = np.array([[parameters[name] for name in self.names]])
        order = self.in_order(values)[0]
        return {**parameters, **dict(zip(self.names, values[0, order].tolist(), strict=True))}

    def sample(self, parameters: Mapping[str, float]) -> Network:
        """Return the network of one sample with these parameters, by name."""
        return self.network([[parameters[name] for name in self.names]])


K = Parameter("k", "stiffness", "Maxwell spring", "k")
K_P = Parameter("k_p", "stiffness", "parallel (membrane) spring", "k_p", may_vanish=True)
C = Parameter("c", "damping", "Maxwell damper", "c")
C_P = Parameter("c_p", "damping", "parallel damper", "c_p", may_vanish=True)

SINGLE_BRANCH: tuple[Parameter, ...] = (K, K_P, C, C_P)
"""The paper's parameters, which have columns in every file of identifications."""


# Spring or damper of an absent branch, in N/m or N s/m, too small to affect a response.
_GONE = 1e-18


def _branches(springs: Array, dampers: Array) -> tuple[Array, Array]:
    """Return springs and dampers of branches, (n, n_branches), tiny where a branch is absent.

    Absent branches get different rates, since equal rates cost digits.
    """
    if not (np.all(springs) and np.all(dampers)):
        weak = _GONE * 10.0 ** np.arange(len(dampers))[:, None]
        springs, dampers = np.where(springs, springs, _GONE), np.where(dampers, dampers, weak)
    return springs.T, dampers.T


def generalized_maxwell(parameters: ArrayLike) -> Network:
    r"""Return generalized Maxwell-Wiechert samples, Figure 5 (2).

    With one branch the columns are k, k_p, c, c_p; with more they are
    k_1 ... k_n, k_p, c_1 ... c_n, c_p.

    ::

              +---/\/\/---[==]---+
              |    k_1    c_1    |
              +---/\/\/---[==]---+      (any number of branches)
              |    k_2    c_2    |
        B o---+------/\/\/-------+---o C
              |       k_p        |
              +-------[==]-------+
                      c_p
    """
    columns = columns_of(parameters)
    n = len(columns) // 2 - 1
    k, c = _branches(columns[:n], columns[n + 1 : 2 * n + 1])
    return Network(k_p=columns[n], c_p=columns[-1], k=k, c=c)


def liquid_drop(parameters: ArrayLike) -> Network:
    r"""Return Maxwell liquid drops with membrane stiffness, Figure 5 (1); columns k, k_p, c.

    ::

              +---/\/\/---[==]---+
              |     k       c    |
        B o---+------/\/\/-------+---o C
                      k_p
    """
    k, k_p, c = columns_of(parameters)
    return Network(k_p=k_p, c_p=np.zeros_like(k_p), k=k[:, None], c=c[:, None])


def kelvin_voigt(parameters: ArrayLike) -> Network:
    r"""Return Kelvin-Voigt solids; columns k_p, c_p.

    ::

              +------/\/\/-------+
        B o---+       k_p        +---o C
              +-------[==]-------+
                      c_p
    """
    k_p, c_p = columns_of(parameters)
    none = np.zeros((len(k_p), 0))
    return Network(k_p=k_p, c_p=c_p, k=none, c=none)


def damper(parameters: ArrayLike) -> Network:
    r"""Return bare dampers, Newtonian liquids; column c_p.

    ::

        B o---[==]---o C
               c_p
    """
    (c_p,) = columns_of(parameters)
    none = np.zeros((len(c_p), 0))
    return Network(k_p=np.zeros_like(c_p), c_p=c_p, k=none, c=none)


def maxwell(parameters: ArrayLike) -> Network:
    r"""Return Maxwell liquids; columns k, c.

    ::

        B o---/\/\/---[==]---o C
                k       c
    """
    k, c = columns_of(parameters)
    none = np.zeros_like(k)
    return Network(k_p=none, c_p=none, k=k[:, None], c=c[:, None])


def zener_kelvin(parameters: ArrayLike) -> Network:
    r"""Return Zener (standard linear) solids in Kelvin's form; columns k_s, k_v, c_v.

    Their Maxwell form has k_p = k_s k_v/(k_s + k_v), k = k_s^2/(k_s + k_v) and
    c = c_v [k_s/(k_s + k_v)]^2.

    ::

                         +---/\/\/---+
        B o---/\/\/------+    k_v    +---o C
               k_s       +---[==]----+
                              c_v
    """
    k_s, k_v, c_v = columns_of(parameters)
    share = 1 / (1 + k_v / k_s)
    return Network(
        k_p=share * k_v,
        c_p=np.zeros_like(k_s),
        k=(share * k_s)[:, None],
        c=(share**2 * c_v)[:, None],
    )


def burgers(parameters: ArrayLike) -> Network:
    r"""Return Burgers fluids; columns k_s, c_s, k_v, c_v.

    A Maxwell liquid and a Kelvin-Voigt element in series have the compliance
    1/k_s + 1/(c_s s) + 1/(k_v + c_v s). Its inverse is two Maxwell branches, their
    rates the roots of a r^2 - b r + k_v with a = c_s c_v/k_s, e = c_s k_v/k_s and
    b = c_s + c_v + e; their springs share k_s. The formulas have no cancellation.

    ::

                                +---/\/\/---+
        B o---/\/\/---[==]------+    k_v    +---o C
               k_s    c_s       +---[==]----+
                                     c_v
    """
    k_s, c_s, k_v, c_v = columns_of(parameters)
    e = c_s * k_v / k_s
    d = c_s + c_v - e
    root = np.sqrt(d * d + 4 * c_s * e)
    larger = 0.5 * (np.where(d.real >= 0, d, -d) + root)
    smaller = c_s * e / larger
    # q - e and e - q', with q and q' the greater and lesser of (b +- root) / 2.
    fast, slow = np.where(d.real >= 0, (larger, smaller), (smaller, larger))
    q = e + fast
    rates = np.stack((q * k_s / (c_s * c_v), k_v / q), axis=1)
    springs = np.stack((k_s * fast / root, k_s * slow / root), axis=1)
    none = np.zeros_like(k_s)
    return Network(k_p=none, c_p=none, k=springs, c=springs / rates)


_K_S = Parameter("k_s", "stiffness", "series spring", "k")
_C_S = Parameter("c_s", "damping", "series damper", "c")
_K_V = Parameter("k_v", "stiffness", "spring of the Kelvin-Voigt element", "k")
_C_V = Parameter("c_v", "damping", "damper of the Kelvin-Voigt element", "c")
_K_ALPHA = Parameter("k_alpha", "springpot", "springpot, modulus at 1 rad/s", "k")
_ALPHA = Parameter("alpha", "exponent", "exponent of the springpot", "alpha", below=1.0)

MODELS: dict[str, SampleModel] = {
    model.name: model
    for model in (
        SampleModel(
            "generalized_maxwell",
            "generalized Maxwell-Wiechert model",
            SINGLE_BRANCH,
            generalized_maxwell,
            exchangeable=("c", "c_p"),
            branches=(("k", "c"),),
        ),
        SampleModel(
            "liquid_drop",
            "Maxwell liquid drop with membrane stiffness",
            (K, K_P, C),
            liquid_drop,
        ),
        SampleModel(
            "damper", "bare damper", (replace(C_P, meaning="damper", may_vanish=False),), damper
        ),
        SampleModel("kelvin_voigt", "Kelvin-Voigt solid", (K_P, C_P), kelvin_voigt),
        SampleModel("maxwell", "Maxwell liquid", (K, C), maxwell),
        SampleModel(
            "zener_maxwell",
            "Zener solid, Maxwell form",
            (K, replace(K_P, meaning="parallel spring"), C),
            liquid_drop,
        ),
        SampleModel("zener_kelvin", "Zener solid, Kelvin form", (_K_S, _K_V, _C_V), zener_kelvin),
        SampleModel("burgers", "Burgers fluid", (_K_S, _C_S, _K_V, _C_V), burgers),
        SampleModel(
            "fractional_kelvin_voigt",
            "fractional Kelvin-Voigt solid",
            (replace(K_P, meaning="parallel spring"), _K_ALPHA, _ALPHA),
            fractional_kelvin_voigt,
        ),
        SampleModel(
            "fractional_maxwell",
            "fractional Maxwell liquid",
            (_K_ALPHA, _ALPHA, replace(C, meaning="series damper")),
            fractional_maxwell,
        ),
    )
}


def model_named(name: str, branches: int = 1) -> SampleModel:
    """Return a model by name, the generalized one with a number of Maxwell branches."""
    model = MODELS[name]
    if branches == 1:
        return model
    springs = tuple(
        replace(K, name=f"k_{j}", meaning=f"spring of branch {j}") for j in range(1, branches + 1)
    )
    dampers = tuple(
        replace(C, name=f"c_{j}", meaning=f"damper of branch {j}") for j in range(1, branches + 1)
    )
    return replace(
        model,
        title=f"{model.title}, {branches} branches",
        parameters=(*springs, K_P, *dampers, C_P),
        exchangeable=(*(damper.name for damper in dampers), "c_p"),
        branches=tuple((k.name, c.name) for k, c in zip(springs, dampers, strict=True)),
    )


def with_fixed(model: SampleModel, fixed: Mapping[str, float]) -> SampleModel:
    """Return a model with some parameters fixed at known values, and only the others free."""
    if not fixed:
        return model
    free = tuple(p for p in model.parameters if p.name not in fixed)

    def network(parameters: ArrayLike) -> Network:
        given = np.atleast_2d(np.asarray(parameters) * 1.0)
        columns = dict(zip((p.name for p in free), given.T, strict=True))
        filled = [
            columns.get(name, np.full(len(given), fixed.get(name, np.nan))) for name in model.names
        ]
        return model.network(np.stack(filled, axis=1))

    return replace(model, parameters=free, network=network)


@dataclass(frozen=True)
class Sample:
    """Name of a sample's constitutive model, and its number of branches.

    Parameters
    ----------
    name
        Name of the model.
    branches
        Number of Maxwell branches of a generalized one.
    """

    name: str
    branches: int = 1

    @property
    def model(self) -> SampleModel:
        """The constitutive model."""
        return model_named(self.name, self.branches)

    @property
    def candidate(self) -> str:
        """Its name among `CANDIDATES`."""
        return self.name if self.branches == 1 else f"{self.name}_{self.branches}"


CANDIDATES: dict[str, Sample] = {
    sample.candidate: sample
    for sample in (
        *(Sample(name) for name in MODELS),
        *(Sample("generalized_maxwell", n) for n in range(2, MOST_BRANCHES + 1)),
    )
}
"""Models that a trace may be fitted with, by name with the number of branches."""
