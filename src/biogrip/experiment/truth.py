"""True parameters of simulated samples, and the paper's results for comparison."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.experiment.sample import SINGLE_BRANCH, Parameter, Sample, SampleModel
from biogrip.keys import Block, OneOf

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


@dataclass(frozen=True)
class Truth:
    """Model and true parameters of a simulated sample, and the paper's results for it."""

    title: str
    """Name in print."""
    sample: Sample
    """Its constitutive model."""
    parameters: Mapping[str, float]
    """True values by name, SI units; empty if the trace was recorded."""
    published: Published
    """Results of the paper."""

    @property
    def model(self) -> SampleModel:
        """Constitutive model."""
        return self.sample.model

    def target(self, quantity: list[Parameter]) -> float | None:
        """Return the true value of a parameter or a sum; None if the trace was recorded."""
        return sum(self.parameters[p.name] for p in quantity) if self.parameters else None
