"""Constitutive models of springs and dampers (Figure 5), and all models by name.

Every network is a parallel spring k_p and damper c_p beside any number of Maxwell branches (a
spring k and a damper c in series). Its force follows the shortening delta of the sample as

    F(s) = [k_p + c_p s + sum_j k_j c_j s / (k_j + c_j s)] delta(s)

A model is one entry of `MODELS`, declared beside its network; genome, tables and figures follow
from it. Where an element vanishes, at zero beside others or at infinity in series, a model becomes
a simpler one; a springpot is a spring at an exponent of zero, and a damper at one. The simpler
model's parameters are turned into those of the richer one. Each model says which it contains
directly; those in these are in it as well. The paper's results to compare with are here, too.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from math import inf

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError, nearest_three
from biogrip.physics.fractional import FRACTIONAL_MODELS
from biogrip.physics.sample_model import (
    C_P,
    K_P,
    MOST_BRANCHES,
    SINGLE_BRANCH,
    C,
    K,
    Network,
    Parameter,
    SampleModel,
    Turned,
    of_columns,
    with_stiffness_unit,
)

K_S = Parameter("k_s", "stiffness", "series spring", "k")
C_S = Parameter("c_s", "damping", "series damper", "c")
K_V = Parameter("k_v", "stiffness", "spring of the Kelvin-Voigt element", "k")
C_V = Parameter("c_v", "damping", "damper of the Kelvin-Voigt element", "c")

# A spring or damper of a branch that is gone, in N/m or N s/m: no response shows it.
_SPRING_OF_NO_BRANCH = 1e-18


@of_columns
def generalized_maxwell(*columns: Array) -> Network:
    """Generalized Maxwell-Wiechert model, Figure 5 (2): branches beside a spring and a damper.

    With one branch the columns are k, k_p, c, c_p; with more k_1 ... k_n, k_p, c_1 ... c_n, c_p.
    """
    n = len(columns) // 2 - 1
    k, c = (np.array(columns)[some] for some in (slice(n), slice(n + 1, 2 * n + 1)))
    if not (np.all(k) and np.all(c)):
        # Of several branches that are gone none relaxes with another: equal rates cost digits.
        weak = _SPRING_OF_NO_BRANCH * 10.0 ** np.arange(n)[:, None]
        k, c = np.where(k, k, _SPRING_OF_NO_BRANCH), np.where(c, c, weak)
    return Network(k_p=columns[n], c_p=columns[-1], k=k.T, c=c.T)


def _without_branches(k_p: Array, c_p: Array) -> Network:
    none = np.zeros((len(c_p), 0))
    return Network(k_p=k_p, c_p=c_p, k=none, c=none)


def _one_branch(k: Array, k_p: Array, c: Array) -> Network:
    """Return a Maxwell branch beside a spring, Figure 5 (1): a drop in its membrane."""
    return Network(k_p=k_p, c_p=np.zeros_like(k), k=k[:, None], c=c[:, None])


@of_columns
def burgers(k_s: Array, c_s: Array, k_v: Array, c_v: Array) -> Network:
    """Burgers fluid; columns k_s, c_s, k_v, c_v.

    A Maxwell liquid and a Kelvin-Voigt element in series have the compliance 1/k_s + 1/(c_s s) +
    1/(k_v + c_v s). Its inverse is two Maxwell branches, their rates the roots of a r^2 - b r + k_v
    with a = c_s c_v/k_s, e = c_s k_v/k_s and b = c_s + c_v + e; their springs share k_s. Written
    without differences.
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
    """Zener solid: from Kelvin's form, k_s before k_v and c_v side by side, to Maxwell's.

    This has k_p = k_s k_v/(k_s + k_v), k = k_s^2/(k_s + k_v) and c = c_v [k_s/(k_s + k_v)]^2.
    """
    share = 1 / (1 + k_v / k_s)
    return share * k_s, share * k_v, share**2 * c_v


def _with_empty_branch(*parameters: Array) -> tuple[Array | float, ...]:
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
    contains: dict[str, Turned] = {f"generalized_maxwell_{branches - 1}": _with_empty_branch}
    if branches == 2:
        contains = {"generalized_maxwell": _with_empty_branch, "burgers": _two_branches}
    return replace(
        GENERALIZED_MAXWELL,
        title=f"{GENERALIZED_MAXWELL.title}, {branches} branches",
        parameters=(*springs, K_P, *dampers, C_P),
        example=(*(9.5 for _ in numbers), 0.3, *(10.0 * 4.0**j for j in numbers), 0.7),
        exchangeable=(*(damper.name for damper in dampers), "c_p"),
        branches=tuple((k.name, c.name) for k, c in zip(springs, dampers, strict=True)),
        contains=contains,
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
)
MAXWELL_MODELS = (
    GENERALIZED_MAXWELL,
    SampleModel(
        "liquid_drop",
        "Maxwell liquid drop with membrane stiffness",
        (K, K_P, C),
        of_columns(_one_branch),
        example=(9.5, 0.3, 10.0),
        contains={"zener_maxwell": _same, **_IN_A_DROP},
    ),
    SampleModel(
        "damper",
        "bare damper",
        (replace(C_P, meaning="damper", may_vanish=False),),
        of_columns(lambda c_p: _without_branches(0 * c_p, c_p)),
        example=(10.0,),
    ),
    SampleModel(
        "kelvin_voigt",
        "Kelvin-Voigt solid",
        (K_P, C_P),
        of_columns(_without_branches),
        example=(0.3, 10.0),
        contains={"damper": lambda c_p: (0.0, c_p)},
    ),
    SampleModel(
        "maxwell",
        "Maxwell liquid",
        (K, C),
        of_columns(lambda k, c: _one_branch(k, 0 * k, c)),
        example=(2.0, 50.0),
        contains={"damper": lambda c_p: (inf, c_p)},
    ),
    SampleModel(
        "zener_maxwell",
        "Zener solid, Maxwell form",
        (K, replace(K_P, meaning="parallel spring"), C),
        of_columns(_one_branch),
        example=(2.0, 1.0, 50.0),
        contains={"liquid_drop": _same, **_IN_A_DROP},
    ),
    SampleModel(
        "zener_kelvin",
        "Zener solid, Kelvin form",
        (K_S, K_V, C_V),
        of_columns(lambda *elements: _one_branch(*_to_maxwell(*elements))),
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
    ),
)

MODELS: dict[str, SampleModel] = {
    model.name: model for model in (*MAXWELL_MODELS, *FRACTIONAL_MODELS)
}

ALIASES = {
    **dict.fromkeys(("sls", "standard_linear_solid", "zener"), "zener_maxwell"),
    **{"kv": "kelvin_voigt", "dashpot": "damper", "power_law": "springpot", "drop": "liquid_drop"},
}
"""Usual names of models; ``prony3`` or ``sls3`` is `generalized_maxwell_3` without c_p."""


_WITH_BRANCHES = re.compile(rf"{GENERALIZED_MAXWELL.name}_([1-{MOST_BRANCHES}])")


@dataclass(frozen=True)
class Sample:
    """Name of a sample's constitutive model, and its number of branches."""

    name: str
    """Name of the model."""
    branches: int = 1
    """Number of Maxwell branches of a generalized one."""
    stiffness: str = "N/m"
    """Unit of its stiffnesses: N/m, Pa, or none if they are shares of another."""

    def __post_init__(self) -> None:
        """Take a usual name, as sls, or one with the number of branches; refuse an unknown one."""
        name = ALIASES.get(self.name.lower(), self.name)
        if branches := _WITH_BRANCHES.fullmatch(name):
            name = GENERALIZED_MAXWELL.name
            object.__setattr__(self, "branches", int(branches[1]))
        if name not in MODELS:
            near = nearest_three(name, [*MODELS, *ALIASES])
            raise BiogripError(f"found the sample model '{name}'. Did you mean {near}?")
        object.__setattr__(self, "name", name)

    @property
    def model(self) -> SampleModel:
        """The constitutive model."""
        model = MODELS[self.name]
        if self.branches != 1:
            if model is not GENERALIZED_MAXWELL:
                raise ValueError(f"{self.name} has no number of branches")
            model = _with_branches(self.branches)
        return model if self.stiffness == "N/m" else with_stiffness_unit(model, self.stiffness)

    @property
    def candidate(self) -> str:
        """Its name among `CANDIDATES`."""
        return self.name if self.branches == 1 else f"{self.name}_{self.branches}"


CANDIDATES: dict[str, Sample] = {
    sample.candidate: sample
    for sample in (
        *map(Sample, MODELS),
        *(Sample(GENERALIZED_MAXWELL.name, more) for more in range(2, MOST_BRANCHES + 1)),
    )
}
"""Models that a trace may be fitted with, by name with the number of branches."""


@cache
def contained(candidate: str) -> Mapping[str, tuple[Turned, ...]]:
    """Return the candidates nested in one, each with the fewest conversions of its parameters."""
    nested: dict[str, tuple[Turned, ...]] = {candidate: ()}
    ahead = [candidate]
    for richer in ahead:
        for name, turned in CANDIDATES[richer].model.contains.items():
            if name not in nested:
                nested[name] = (turned, *nested[richer])
                ahead.append(name)
    del nested[candidate]
    return nested


def different_in(candidate: str, others: Collection[str]) -> list[str]:
    """Return those of `others` that are nested in one, and one of models that are equivalent."""
    different: list[str] = []
    for name in filter(others.__contains__, contained(candidate)):
        if not any(name in contained(other) and other in contained(name) for other in different):
            different.append(name)
    return different


def as_richer(candidate: str, simpler: str, parameters: Array) -> Array:
    """Convert a nested model's parameters, (n_parameters,), to those of a richer model."""
    with np.errstate(invalid="ignore", divide="ignore"):
        for turned in contained(candidate)[simpler]:
            parameters = np.array(turned(*parameters), dtype=float)
    return parameters
