"""The Burgers fluid: a Maxwell liquid and a Kelvin-Voigt element in series."""

from math import inf

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array
from biogrip.experiment.network import Network, columns_of
from biogrip.experiment.sample_model import C_S, C_V, K_S, K_V, SampleModel


def burgers(parameters: ArrayLike) -> Network:
    r"""Burgers fluid; columns k_s, c_s, k_v, c_v.

    A Maxwell liquid and a Kelvin-Voigt element in series have the compliance
    1/k_s + 1/(c_s s) + 1/(k_v + c_v s). Its inverse is two Maxwell branches, their
    rates the roots of a r^2 - b r + k_v with a = c_s c_v/k_s, e = c_s k_v/k_s and
    b = c_s + c_v + e; their springs share k_s. Written without differences.

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


def _two_branches(*parameters: Array) -> tuple[Array | float, ...]:
    network = burgers(np.array([parameters]))
    (k_1, k_2), (c_1, c_2) = network.k[0], network.c[0]
    return k_1, k_2, 0.0, c_1, c_2, 0.0


BURGERS = SampleModel(
    "burgers",
    "Burgers fluid",
    (K_S, C_S, K_V, C_V),
    burgers,
    example=(3.0, 200.0, 2.0, 40.0),
    contains={
        "maxwell": lambda k, c: (k, c, inf, inf),
        "zener_kelvin": lambda k_s, k_v, c_v: (k_s, inf, k_v, c_v),
    },
    within={"generalized_maxwell_2": _two_branches},
)
