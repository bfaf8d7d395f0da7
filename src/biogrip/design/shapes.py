"""Families of torques that the search can use, depending on the generator."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from biogrip.arrays import Array
from biogrip.design import ramps, sinusoids, steps
from biogrip.design.waveform import Limits, Waveform


@dataclass(frozen=True)
class Shape:
    """A family of torques."""

    shares: int
    """Number of numbers between 0 and 1 that define a torque."""
    waveform: Callable[[Array, Limits], Waveform]
    """Function that converts them to a torque."""


STEPS = "steps"
"""Name of trains of steps."""

SHAPES: Mapping[str, Shape] = {
    STEPS: Shape(steps.SHARES, steps.steps),
    "ramps": Shape(ramps.SHARES, ramps.ramps),
    "sinusoids": Shape(sinusoids.SHARES, sinusoids.sinusoids),
}
"""Families by name; an added family can be selected by its name in the config."""
