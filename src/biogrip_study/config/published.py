"""What the paper reports of a sample, to compare with."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.keys import Block, OneOf
from biogrip.physics.sample_model import SINGLE_BRANCH

_Parameter = Annotated[str, OneOf(tuple(parameter.name for parameter in SINGLE_BRANCH))]
_PrintedError = Annotated[
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
    axis_rad: Annotated[
        tuple[Annotated[float, Field(ge=-10, le=10)], ...], Field(min_length=2, max_length=2)
    ] = ()
    """Ends of the rotation axis of the paper's figure."""
    identified: Mapping[_Parameter, Annotated[float, Field(ge=0, le=1e12)]]
    """Identified parameters as printed, SI units."""
    error_percent: Mapping[_Parameter, _PrintedError]
    """Their errors in percent as printed, in quotes, for some are no numbers."""


UNPUBLISHED = Published(table=None, identified={}, error_percent={})
"""Record of a sample that the paper does not have."""
