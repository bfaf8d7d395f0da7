"""Settings of sets of experiments at a price, as in the config."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.keys import Block, Problem

_Cost = Annotated[float, Field(ge=0, le=1e9)]


@dataclass(frozen=True, kw_only=True)
class PriceSettings(Block):
    """What experiments cost, in any one unit, and what a set of them is to tell of most cells.

    With it `biogrip design` finds the cheapest sets of experiments with a cell, see docs/design.md.
    """

    per_second: _Cost = 0.0
    """Cost of a second."""
    per_reading: _Cost = 0.0
    """Cost of a reading."""
    per_change: _Cost = 0.0
    """Cost of a change of what is held: of each step, ramp or sinusoid."""
    per_experiment: _Cost = 0.0
    """Cost of each experiment beside these."""
    within: Annotated[float, Field(gt=0, le=1)] = 0.1
    """Largest distance of the ends of a quantity's interval from its value, as a share of it, with
    which it counts as determined. By default 0.1."""
    share: Annotated[float, Field(gt=0, le=1)] = 0.95
    """Share of cells of which all quantities are to be determined. By default 0.95."""
    cells: Annotated[int, Field(ge=2, le=1024)] = 128
    """Cells that sets are chosen for, spread evenly over `design.ranges`; sets are judged by four
    times as many others. By default 128."""
    experiments: Annotated[int, Field(ge=1, le=20)] = 8
    """Most experiments with a cell. By default 8."""

    def cost(self, duration_s: float, readings: int, changes: int) -> float:
        """Return what an experiment costs."""
        seconds, rest = self.per_second * duration_s, self.per_reading * readings
        # Durations are sums, with their rounding errors.
        return float(f"{self.per_experiment + seconds + rest + self.per_change * changes:.12g}")

    def problems(self) -> Iterator[Problem]:
        """Find costs that are all zero."""
        if not self.cost(1.0, 1, 1):
            text = "found no cost, allowed is one above zero at least: per_second, per_reading, "
            yield (), f"{text}per_change or per_experiment."
