"""Settings of simulated sequences of experiments, as in the config."""

from dataclasses import dataclass
from typing import Annotated

from biogrip.keys import Key


@dataclass(frozen=True)
class SequenceSettings:
    """Simulated sequences of experiments on cells, which count those needed, see docs/design.md."""

    cells: Annotated[
        int,
        Key("Cells, drawn uniformly in the logarithms within `design.ranges`.", low=2, high=10_000),
    ]
    experiments: Annotated[int, Key("Experiments with each, by every strategy.", low=2, high=20)]
