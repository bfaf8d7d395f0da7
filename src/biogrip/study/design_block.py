"""Config block of `biogrip design`: limits of a train of steps, and the samples it is for."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.keys import Block, Distinct


@dataclass(frozen=True, kw_only=True)
class DesignBlock(Block):
    """Limits of the trains of steps that `biogrip design` tries, and the samples they are for."""

    steps: Annotated[int, Field(ge=1, le=50)] = 8
    """Number of steps at most. By default 8."""
    largest: Annotated[float | None, Field(gt=0, le=1e12)] = None
    """Largest torque, or what else the protocol holds, in its SI unit. By default the protocol's
    largest."""
    duration_s: Annotated[float | None, Field(ge=1e-6, le=1e9)] = None
    """Duration. By default the protocol's."""
    rate_Hz: Annotated[float | None, Field(ge=1e-9, le=1e9)] = None
    """Most readings a second. There are never more readings in all than under the config's
    protocol. By default `measurement.rate_Hz`."""
    parameters: Annotated[tuple[str, ...], Field(max_length=40), Distinct()] = ()
    """Parameters asked for; the others are unknown all the same. By default all that are not
    fixed."""
    factor: Annotated[float | None, Field(gt=1, le=1000)] = None
    """Factor by which all parameters may be smaller or larger than in a case's sample. By default,
    the cases' samples alone are plausible."""
