"""Families of torques that are searched: what a generator may be able to make."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from biogrip.arrays import Array
from biogrip.design import ramps, sinusoids, steps
from biogrip.design.waveform import Limits, Waveform


@dataclass(frozen=True)
class Shape:
    """A family of torques.

    Parameters
    ----------
    shares
        How many numbers between 0 and 1 make one.
    waveform
        Makes it of them.
    """

    shares: int
    waveform: Callable[[Array, Limits], Waveform]


SHAPES: Mapping[str, Shape] = {
    "steps": Shape(steps.SHARES, steps.steps),
    "ramps": Shape(ramps.SHARES, ramps.ramps),
    "sinusoids": Shape(sinusoids.SHARES, sinusoids.sinusoids),
}
"""By name; a family that is added here is searched where it is asked for."""
