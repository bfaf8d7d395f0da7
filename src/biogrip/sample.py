"""Constitutive models of the sample: spring-dashpot networks between the two jaws (Figure 5).

Every network is a membrane spring k_p and a damper c_p beside any number of
Maxwell branches (a spring k and a damper c in series). Its force follows the
shortening delta of the sample as

    F(s) = [k_p + c_p s + sum_j k_j c_j s / (k_j + c_j s)] delta(s)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array


@dataclass(frozen=True)
class Parameter:
    """A parameter of a sample model.

    Parameters
    ----------
    name
        Identifier in config and code.
    kind
        ``"stiffness"`` or ``"damping"``; decides the unit and the search range.
    meaning
        A few words for tables.
    """

    name: str
    kind: str
    meaning: str

    @property
    def unit(self) -> str:
        """SI unit."""
        return {"stiffness": "N/m", "damping": "N s/m"}[self.kind]

    @property
    def column(self) -> str:
        """Name of the parameter's column in result files."""
        return self.name + {"stiffness": "_N_per_m", "damping": "_Ns_per_m"}[self.kind]


@dataclass(frozen=True)
class Network:
    """The elements of n samples.

    Parameters
    ----------
    k_p, c_p : (n,)
        Parallel spring (N/m) and damper (N s/m).
    k, c : (n, n_branches)
        Spring and damper of each Maxwell branch.
    """

    k_p: Array
    c_p: Array
    k: Array
    c: Array


@dataclass(frozen=True)
class SampleModel:
    """A named constitutive model.

    Parameters
    ----------
    name, title
        Name in the config; name in print.
    parameters
        What there is to identify, in the order of the columns of a population.
    network
        Turns parameters of shape (n, n_parameters) into a `Network`.
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    network: Callable[[Array], Network]

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in column order."""
        return tuple(parameter.name for parameter in self.parameters)


K = Parameter("k", "stiffness", "Maxwell spring")
K_P = Parameter("k_p", "stiffness", "parallel (membrane) spring")
C = Parameter("c", "damping", "Maxwell damper")
C_P = Parameter("c_p", "damping", "parallel damper")


def generalized_maxwell(parameters: ArrayLike) -> Network:
    r"""Generalized Maxwell-Wiechert model, Figure 5 (2); columns k, k_p, c, c_p.

    ::

              +---/\/\/---[==]---+
              |     k       c    |
        B o---+------/\/\/-------+---o C
              |       k_p        |
              +-------[==]-------+
                      c_p
    """
    k, k_p, c, c_p = np.atleast_2d(np.asarray(parameters, dtype=float)).T
    return Network(k_p=k_p, c_p=c_p, k=k[:, None], c=c[:, None])


def liquid_drop(parameters: ArrayLike) -> Network:
    r"""Maxwell liquid drop with membrane stiffness, Figure 5 (1); columns k, k_p, c.

    ::

              +---/\/\/---[==]---+
              |     k       c    |
        B o---+------/\/\/-------+---o C
                      k_p
    """
    k, k_p, c = np.atleast_2d(np.asarray(parameters, dtype=float)).T
    return Network(k_p=k_p, c_p=np.zeros_like(k_p), k=k[:, None], c=c[:, None])


MODELS: dict[str, SampleModel] = {
    model.name: model
    for model in (
        SampleModel(
            "generalized_maxwell",
            "generalized Maxwell-Wiechert model",
            (K, K_P, C, C_P),
            generalized_maxwell,
        ),
        SampleModel(
            "liquid_drop",
            "Maxwell liquid drop with membrane stiffness",
            (K, K_P, C),
            liquid_drop,
        ),
    )
}

ALL_PARAMETERS: tuple[Parameter, ...] = (K, K_P, C, C_P)
