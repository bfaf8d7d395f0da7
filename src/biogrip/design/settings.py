"""Settings of a design, as in the config."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.design.criteria import CRITERIA, OVER
from biogrip.design.shapes import SHAPES
from biogrip.keys import Block, Distinct, OneOf, Problem

# Shortest duration of a step by default, readings in it by default, and its fewest readings.
_SHORTEST_S, _READINGS, _FEWEST = 0.01, 10, 2

_Ends = Annotated[
    tuple[Annotated[float, Field(gt=0, le=1e12)], ...], Field(min_length=2, max_length=2)
]


@dataclass(frozen=True)
class SequenceSettings(Block):
    """Simulated sequences of experiments on cells, which count those needed, see docs/design.md."""

    cells: Annotated[int, Field(ge=2, le=10_000)]
    """Cells, drawn uniformly in the logarithms within `design.ranges`."""
    experiments: Annotated[int, Field(ge=2, le=20)]
    """Experiments with each, by every strategy."""


@dataclass(frozen=True, kw_only=True)
class DesignSettings(Block):
    """Settings of `biogrip design`, which searches for the best torque and sampling times."""

    noise_rad: Annotated[float, Field(ge=1e-15, le=1.0)]
    """Standard deviation of the sensor's noise."""
    readings: Annotated[int, Field(ge=10, le=1_000_000)]
    """Total number of readings."""
    fastest_Hz: Annotated[float, Field(ge=1e-3, le=1e9)]
    """Most readings in a second."""
    longest_s: Annotated[float, Field(ge=1e-6, le=1e6)]
    """Duration of the experiment."""
    largest_torque_Nm: Annotated[float | None, Field(gt=0, le=1.0)] = None
    """Largest torque, as an increment on what closes the jaws onto the sample."""
    largest_voltage_V: Annotated[float | None, Field(gt=0, le=1e4)] = None
    """Largest voltage, instead; counted like a protocol's."""
    shortest_step_s: Annotated[float | None, Field(ge=1e-6, le=1e6)] = None
    """All steps, ramps and sinusoids last whole multiples of this. By default 0.01 s, or ten
    readings at `fastest_Hz` if these take longer."""
    most_steps: Annotated[int, Field(ge=2, le=1000)] = 40
    """Largest number of steps, ramps and sinusoids. By default 40."""
    shapes: Annotated[
        tuple[Annotated[str, OneOf(SHAPES)], ...], Field(min_length=1), Distinct()
    ] = ("steps",)
    """Torques that the generator can make: trains of `steps`, of `ramps` that never jump,
    `sinusoids` on held torques; the best of them is taken. By default steps."""
    criterion: Annotated[str, OneOf(CRITERIA)] = "largest"
    """Function of the covariance of the logarithms asked for to minimize: `largest`, the largest
    relative bound (the default); `D`, its determinant; `A`, the mean of the squared bounds; `E`,
    its largest eigenvalue."""
    over: Annotated[str, OneOf(OVER)] = "worst"
    """Plausible sample that counts, the `worst` (the default), or `mean` over all samples."""
    quantities: Annotated[tuple[str, ...], Field(min_length=1, max_length=40), Distinct()] = ()
    """Parameters that are asked for; the others are free all the same. By default all that are not
    fixed."""
    ranges: Mapping[str, _Ends] | None = None
    """Lowest and highest plausible value of parameters, in SI units. Those without one are as in
    the case's sample. By default, that sample alone is plausible."""
    plausible_samples: Annotated[int, Field(ge=2, le=256)] = 8
    """Plausible samples, spread evenly over these ranges. By default 8."""
    candidates: Annotated[int, Field(ge=128, le=1_000_000)] = 2000
    """Torques that the search tries, about, as many of each shape. By default 2000."""
    sequence: SequenceSettings | None = None

    @property
    def unit_s(self) -> float:
        """Unit of time, of which the durations of steps, ramps and sinusoids are multiples."""
        if self.shortest_step_s is not None:
            return self.shortest_step_s
        return max(_SHORTEST_S, _READINGS / self.fastest_Hz)

    def problems(self) -> Iterator[Problem]:
        """Find keys whose values conflict."""
        if self.sequence and not self.ranges:
            text = "found no design.ranges, which cells are drawn from; allowed is one at least."
            yield ("sequence",), text
        given = [key for key in ("largest_torque_Nm", "largest_voltage_V") if getattr(self, key)]
        if len(given) != 1:
            text = f"found {' and '.join(given) or 'neither'}, allowed is one of largest_torque_Nm "
            yield (), f"{text}and largest_voltage_V."
        if self.unit_s * self.fastest_Hz < _FEWEST:
            text = f"found {self.shortest_step_s}, allowed is at least two samples long, "
            yield ("shortest_step_s",), f"{text}{_FEWEST / self.fastest_Hz:g} s."
        fewest, words = (4, "four ramps") if "ramps" in self.shapes else (2, "two steps")
        shortest_s = fewest * self.unit_s
        if shortest_s > self.longest_s:
            text = f"found {self.longest_s}, allowed is at least {words}, {shortest_s:g} s"
            yield ("longest_s",), f"{text}{self._instead(self.longest_s / fewest)}."
        for name, (low, high) in (self.ranges or {}).items():
            if not low <= high:
                yield ("ranges", name), f"found {low} to {high}, allowed is the lower one first."

    def _instead(self, longest_s: float) -> str:
        """Name the key to change instead if the default length of steps is too long."""
        if self.shortest_step_s is not None:
            return ""
        fastest_Hz = _FEWEST / longest_s
        if fastest_Hz > self.fastest_Hz:
            return f", or a fastest_Hz of at least {fastest_Hz:g}"
        return f", or a shortest_step_s of at most {longest_s:g}"
