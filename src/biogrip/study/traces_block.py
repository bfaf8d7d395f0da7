"""Config block of a table of recorded traces."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.experiment.sample import CANDIDATES
from biogrip.keys import Block, OneOf


@dataclass(frozen=True)
class TracesBlock(Block):
    """A table of recorded traces, which are identified in batches of rows."""

    table: Annotated[str, Field(min_length=1, max_length=4000)]
    """The table, a row a trace; relative to where Snakemake runs."""
    config: Annotated[str | None, Field(min_length=1, max_length=4000)] = None
    """Config of the traces, as `biogrip identify --config` takes it: gripper, protocol, ... By
    default the default study's."""
    model: Annotated[str, OneOf(CANDIDATES)] = "generalized_maxwell"
    """Sample model of all traces; a column `sample.model` goes before it."""
    rows_a_batch: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of rows per job. Changes no result."""
