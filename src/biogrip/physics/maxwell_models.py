"""Constitutive models of springs and dampers (Figure 5): the generalized Maxwell model and others.

Every network is a parallel spring k_p and damper c_p beside any number of Maxwell branches (a
spring k and a damper c in series). Its force follows the shortening delta of the sample as

    F(s) = [k_p + c_p s + sum_j k_j c_j s / (k_j + c_j s)] delta(s)

Networks are made by arithmetic alone, so that parameters with a small imaginary part carry
derivatives through it (`biogrip.physics.modes`). Where elements vanish or are rigid, a model
becomes a simpler one: each declares which it `contains`.
"""

from dataclasses import replace
from math import inf

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.sample_model import (
    C_P,
    C_S,
    C_V,
    K_P,
    K_S,
    K_V,
    SINGLE_BRANCH,
    C,
    K,
    Network,
    SampleModel,
    Turned,
    of_columns,
)

# A spring or damper of a branch that is gone, in N/m or N s/m: no response shows it.
_SPRING_OF_NO_BRANCH = 1e-18


@of_columns
def generalized_maxwell(*columns: Array) -> Network:
    r"""Generalized Maxwell-Wiechert model, Figure 5 (2).

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
    n = len(columns) // 2 - 1
    k, c = (np.array(columns)[some] for some in (slice(n), slice(n + 1, 2 * n + 1)))
    if not (np.all(k) and np.all(c)):
        # Of several branches that are gone none relaxes with another: equal rates cost digits.
        weak = _SPRING_OF_NO_BRANCH * 10.0 ** np.arange(n)[:, None]
        k, c = np.where(k, k, _SPRING_OF_NO_BRANCH), np.where(c, c, weak)
    return Network(k_p=columns[n], c_p=columns[-1], k=k.T, c=c.T)


@of_columns
def liquid_drop(k: Array, k_p: Array, c: Array) -> Network:
    r"""Maxwell liquid drop with membrane stiffness, Figure 5 (1); columns k, k_p, c.

    ::

              +---/\/\/---[==]---+
              |     k       c    |
        B o---+------/\/\/-------+---o C
                      k_p
    """
    return Network(k_p=k_p, c_p=np.zeros_like(k_p), k=k[:, None], c=c[:, None])


@of_columns
def kelvin_voigt(k_p: Array, c_p: Array) -> Network:
    r"""Kelvin-Voigt solid; columns k_p, c_p.

    ::

              +------/\/\/-------+
        B o---+       k_p        +---o C
              +-------[==]-------+
                      c_p
    """
    none = np.zeros((len(k_p), 0))
    return Network(k_p=k_p, c_p=c_p, k=none, c=none)


@of_columns
def damper(c_p: Array) -> Network:
    r"""Bare damper, a Newtonian liquid; column c_p.

    ::

        B o---[==]---o C
               c_p
    """
    none = np.zeros((len(c_p), 0))
    return Network(k_p=np.zeros_like(c_p), c_p=c_p, k=none, c=none)


@of_columns
def maxwell(k: Array, c: Array) -> Network:
    r"""Maxwell liquid; columns k, c.

    ::

        B o---/\/\/---[==]---o C
                k       c
    """
    none = np.zeros_like(k)
    return Network(k_p=none, c_p=none, k=k[:, None], c=c[:, None])


@of_columns
def zener_kelvin(k_s: Array, k_v: Array, c_v: Array) -> Network:
    r"""Zener solid (standard linear solid) in Kelvin's form; columns k_s, k_v, c_v.

    Its Maxwell form has k_p = k_s k_v/(k_s + k_v), k = k_s^2/(k_s + k_v) and
    c = c_v [k_s/(k_s + k_v)]^2.

    ::

                         +---/\/\/---+
        B o---/\/\/------+    k_v    +---o C
               k_s       +---[==]----+
                              c_v
    """
    k, k_p, c = _to_maxwell(k_s, k_v, c_v)
    return Network(k_p=k_p, c_p=np.zeros_like(k_s), k=k[:, None], c=c[:, None])


@of_columns
def burgers(k_s: Array, c_s: Array, k_v: Array, c_v: Array) -> Network:
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


def _to_kelvin(k: Array, k_p: Array, c: Array) -> tuple[Array, ...]:
    """Zener solid: from Maxwell's form, k and c beside k_p, to Kelvin's."""
    share = k_p / k
    return k + k_p, k_p * (1 + share), c * (1 + share) ** 2


def _to_maxwell(k_s: Array, k_v: Array, c_v: Array) -> tuple[Array, ...]:
    """Zener solid: from Kelvin's form to Maxwell's."""
    share = 1 / (1 + k_v / k_s)
    return share * k_s, share * k_v, share**2 * c_v


def _one_branch_more(*parameters: Array) -> tuple[Array | float, ...]:
    half = len(parameters) // 2
    springs, dampers = parameters[: half - 1], parameters[half:-1]
    return *springs, 0.0, parameters[half - 1], *dampers, 0.0, parameters[-1]


def _same(*parameters: Array) -> tuple[Array, ...]:
    return parameters


_IN_A_DROP: dict[str, Turned] = {
    "maxwell": lambda k, c: (k, 0.0, c),
    "kelvin_voigt": lambda k_p, c_p: (inf, k_p, c_p),
    "zener_kelvin": _to_maxwell,
}


def _with_branches(branches: int) -> SampleModel:
    numbers = range(1, branches + 1)
    springs = tuple(replace(K, name=f"k_{j}", meaning=f"spring of branch {j}") for j in numbers)
    dampers = tuple(replace(C, name=f"c_{j}", meaning=f"damper of branch {j}") for j in numbers)
    fewer = "generalized_maxwell" + (f"_{branches - 1}" if branches > 2 else "")
    return replace(
        GENERALIZED_MAXWELL,
        title=f"{GENERALIZED_MAXWELL.title}, {branches} branches",
        parameters=(*springs, K_P, *dampers, C_P),
        example=(*(9.5 for _ in numbers), 0.3, *(10.0 * 4.0**j for j in numbers), 0.7),
        exchangeable=(*(damper.name for damper in dampers), "c_p"),
        branches=tuple((k.name, c.name) for k, c in zip(springs, dampers, strict=True)),
        contains={fewer: _one_branch_more},
    )


GENERALIZED_MAXWELL = SampleModel(
    "generalized_maxwell",
    "generalized Maxwell-Wiechert model",
    SINGLE_BRANCH,
    generalized_maxwell,
    example=(9.5, 0.3, 10.0, 0.7),
    exchangeable=("c", "c_p"),
    branches=(("k", "c"),),
    contains={
        "liquid_drop": lambda k, k_p, c: (k, k_p, c, 0.0),
        "kelvin_voigt": lambda k_p, c_p: (0.0, k_p, 0.0, c_p),
    },
    branched=_with_branches,
)
MAXWELL_MODELS = (
    GENERALIZED_MAXWELL,
    SampleModel(
        "liquid_drop",
        "Maxwell liquid drop with membrane stiffness",
        (K, K_P, C),
        liquid_drop,
        example=(9.5, 0.3, 10.0),
        contains={"zener_maxwell": _same, **_IN_A_DROP},
    ),
    SampleModel(
        "damper",
        "bare damper",
        (replace(C_P, meaning="damper", may_vanish=False),),
        damper,
        example=(10.0,),
    ),
    SampleModel(
        "kelvin_voigt",
        "Kelvin-Voigt solid",
        (K_P, C_P),
        kelvin_voigt,
        example=(0.3, 10.0),
        contains={"damper": lambda c_p: (0.0, c_p)},
    ),
    SampleModel(
        "maxwell",
        "Maxwell liquid",
        (K, C),
        maxwell,
        example=(2.0, 50.0),
        contains={"damper": lambda c_p: (inf, c_p)},
    ),
    SampleModel(
        "zener_maxwell",
        "Zener solid, Maxwell form",
        (K, replace(K_P, meaning="parallel spring"), C),
        liquid_drop,
        example=(2.0, 1.0, 50.0),
        contains={"liquid_drop": _same, **_IN_A_DROP},
    ),
    SampleModel(
        "zener_kelvin",
        "Zener solid, Kelvin form",
        (K_S, K_V, C_V),
        zener_kelvin,
        example=(3.0, 2.0, 40.0),
        contains={
            "liquid_drop": _to_kelvin,
            "maxwell": lambda k, c: (k, 0.0, c),
            "kelvin_voigt": lambda k_p, c_p: (inf, k_p, c_p),
        },
    ),
    SampleModel(
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
    ),
)
