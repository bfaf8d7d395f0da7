"""Settings of simulated sequences of experiments, as in the config."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.keys import Block


@dataclass(frozen=True)
class SequenceSettings(Block):
    """Simulated sequences of experiments on cells, which count those needed, see docs/design.md."""

    cells: Annotated[int, Field(ge=2, le=10_000)]
    """Cells, drawn uniformly in the logarithms within `design.ranges`."""
    experiments: Annotated[int, Field(ge=2, le=20)]
    """Experiments with each, by every strategy."""
