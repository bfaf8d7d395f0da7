"""Nested sample models: limits in which a model becomes a simpler one.

Where an element vanishes, a model becomes a simpler one: a spring or damper beside others at
zero, one in series with others rigid, at infinity; a springpot is a spring at an exponent of
zero, and a damper at one. The simpler model's parameters are turned into those of the richer
one, zeros and infinities among them (`biogrip.experiment.sample` gives such samples the same
response). Each model says which it contains directly; those in these are in it as well.
"""

from collections.abc import Collection, Mapping
from functools import cache
from typing import TypeAlias

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import CANDIDATES
from biogrip.experiment.sample_model import Turned

Way: TypeAlias = tuple[Turned, ...]
"""Conversions of parameters, from one model to the next."""


def _directly(candidate: str) -> dict[str, Turned]:
    """Models that one contains, as it and they declare."""
    others = {name: other.model.within for name, other in CANDIDATES.items()}
    said = {name: within[candidate] for name, within in others.items() if candidate in within}
    return {**CANDIDATES[candidate].model.contains, **said}


@cache
def contained(candidate: str) -> Mapping[str, Way]:
    """Return the candidates nested in one, each with the shortest way of conversions to it."""
    found: dict[str, Way] = {candidate: ()}
    ahead = [candidate]
    for richer in ahead:
        for name, turned in _directly(richer).items():
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
