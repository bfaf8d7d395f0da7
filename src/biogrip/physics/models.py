"""The sample models that there are, by name, and which of them are limits of which.

A model is one entry of `MODELS`, declared beside its network; genome, tables and figures follow
from it. Where an element vanishes, a model becomes a simpler one: a spring or damper beside others
at zero, one in series with others rigid, at infinity; a springpot is a spring at an exponent of
zero, and a damper at one. The simpler model's parameters are turned into those of the richer one,
zeros and infinities among them, and such samples have the same response. Each model says which it
contains directly; those in these are in it as well.

True parameters of simulated samples, and the paper's results to compare with, are here, too.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block, OneOf
from biogrip.physics.fractional import FRACTIONAL_MODELS
from biogrip.physics.maxwell_models import MAXWELL_MODELS
from biogrip.physics.sample_model import (
    MOST_BRANCHES,
    SINGLE_BRANCH,
    SampleModel,
    Turned,
    in_pascals,
)

MODELS: dict[str, SampleModel] = {
    model.name: model for model in (*MAXWELL_MODELS, *FRACTIONAL_MODELS)
}


@dataclass(frozen=True)
class Sample:
    """Name of a sample's constitutive model, and its number of branches."""

    name: str
    """Name of the model."""
    branches: int = 1
    """Number of Maxwell branches of a generalized one."""
    per_area: bool = False
    """True if its elements relate stress and strain, and have units of moduli."""

    @property
    def model(self) -> SampleModel:
        """The constitutive model."""
        model = MODELS[self.name]
        if self.branches != 1:
            if model.branched is None:
                raise ValueError(f"{self.name} has no number of branches")
            model = model.branched(self.branches)
        return in_pascals(model) if self.per_area else model

    @property
    def candidate(self) -> str:
        """Its name among `CANDIDATES`."""
        return self.name if self.branches == 1 else f"{self.name}_{self.branches}"


CANDIDATES: dict[str, Sample] = {
    sample.candidate: sample
    for sample in (
        *(Sample(name) for name in MODELS),
        *(
            Sample(name, branches)
            for name, model in MODELS.items()
            if model.branched
            for branches in range(2, MOST_BRANCHES + 1)
        ),
    )
}
"""Models that a trace may be fitted with, by name with the number of branches."""


def _directly(candidate: str) -> dict[str, Turned]:
    """Models that one contains, as it and they declare."""
    of_others = {
        name: other.model.within[candidate]
        for name, other in CANDIDATES.items()
        if candidate in other.model.within
    }
    return {**CANDIDATES[candidate].model.contains, **of_others}


@cache
def contained(candidate: str) -> Mapping[str, tuple[Turned, ...]]:
    """Return the candidates nested in one, each with the fewest conversions of its parameters."""
    found: dict[str, tuple[Turned, ...]] = {candidate: ()}
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


_Parameter = Annotated[str, OneOf(tuple(parameter.name for parameter in SINGLE_BRANCH))]
_Signed = Annotated[
    str,
    Field(
        pattern=r"^[<>]?[+-]?[0-9]{1,6}(\.[0-9]{1,3})?$",
        json_schema_extra={
            "form": "a number of at most 12 characters, with < or > before it where the paper has "
            "it"
        },
    ),
]


@dataclass(frozen=True, kw_only=True)
class Published(Block):
    """Results of the paper for a sample, to compare with."""

    table: Annotated[int | None, Field(ge=1, le=1000)]
    """Number of the paper's table."""
    figure: Annotated[int | None, Field(ge=1, le=1000)] = None
    """Number of the paper's figure of the fit."""
    generation: Annotated[int | None, Field(ge=1, le=1_000_000)] = None
    """Generation at which the paper shows the fit."""
    axis_rad: Annotated[
        tuple[Annotated[float, Field(ge=-10, le=10)], ...], Field(min_length=2, max_length=2)
    ] = ()
    """Ends of the rotation axis of the paper's figure."""
    identified: Mapping[_Parameter, Annotated[float, Field(ge=0, le=1e12)]]
    """Identified parameters as printed, SI units."""
    error_percent: Mapping[_Parameter, _Signed]
    """Their errors in percent as printed, in quotes, for some are no numbers."""


UNPUBLISHED = Published(table=None, identified={}, error_percent={})
"""Record of a sample that the paper does not have."""
