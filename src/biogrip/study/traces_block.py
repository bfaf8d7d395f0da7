"""Config block of a sheet of recorded traces."""

from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field, Tag

from biogrip.experiment.sample import CANDIDATES
from biogrip.keys import BY_KIND, Block, OneOf

KEY = "traces"

READ = ("rows", "given")
"""Keys of the block that a run fills in."""


@dataclass(frozen=True)
class RowBlock(Block):
    """A row of the sheet, as a run has read it."""

    file: str
    """File of the trace."""
    cell: str
    """Name of its cell."""
    line: int
    """Line of the row, from 1."""
    factors: dict[str, str] = field(default_factory=dict)
    """Values of the factors by name."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Blocks of the config for this trace."""


@dataclass(frozen=True)
class TracesBlock(Block):
    """A sheet of recorded traces, and how to identify them."""

    sheet: Annotated[str, Field(min_length=1, max_length=4000)]
    """The sheet, a row a trace; relative to where Snakemake runs."""
    model: Annotated[str, OneOf(CANDIDATES)] = "generalized_maxwell"
    """Sample model of all traces; a column `sample.model` goes before it."""
    by: Annotated[str | None, Field(min_length=1, max_length=100)] = None
    """Factor that makes groups: by default `group`, or the only one."""
    rows: tuple[RowBlock, ...] = ()
    """The rows, filled in when a run starts; not for a config."""
    given: dict[str, Any] = field(default_factory=dict)
    """The blocks that the config gives, likewise."""


Traces = Annotated[
    Annotated[TracesBlock, Tag("a block of keys")] | Annotated[str, Tag("text")], BY_KIND
]
"""A sheet alone, or with options."""
