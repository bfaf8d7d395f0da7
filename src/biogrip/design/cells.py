"""Stretches of time after a step in which what is seen hardly changes.

A step is divided into slots, one for every reading that the sampling is fast enough for. At first
a cell is a slot, for arms ring; then cells grow by the same factor. Where the torque swings, a
cell is a part of a period, and from the second period on the same part of several that follow one
another: once the ring is over, they show the same.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray

_SINGLE = 24


@dataclass(frozen=True)
class Cells:
    """Cells after a step.

    Parameters
    ----------
    first : (n_cells,)
        First slot of each; slot j is j slots after the step.
    slots : (n_cells,)
        How many slots that follow one another each has.
    repeats : (n_cells,)
        How often a cell has so many.
    stride
        After how many slots it has them again.
    """

    first: IntArray
    slots: IntArray
    repeats: IntArray
    stride: int = 0

    @property
    def capacity(self) -> IntArray:
        """How many readings a cell has room for, (n_cells,)."""
        return self.slots * self.repeats

    @property
    def middle(self) -> Array:
        """Geometric means of the first and the last slot, in the middle period, (n_cells,)."""
        first = self.first + self.stride * ((self.repeats - 1) // 2)
        return np.sqrt(first * (first + self.slots - 1.0))


def cells(slots: int, growth: float, longest: int | None = None) -> Cells:
    """Divide the first so many slots after a step, of which the last is the next step's.

    Parameters
    ----------
    slots
        How many there are.
    growth
        Factor by which cells become longer.
    longest
        How long at most.
    """
    firsts = list(range(1, min(_SINGLE, slots)))
    place = float(_SINGLE)
    while place < slots:
        firsts.append(int(place))
        further = place * growth if longest is None else min(place * growth, place + longest)
        place = max(further, place + 1.0)
    first = np.array(firsts, dtype=np.intp)
    lasting = np.diff(np.append(first, slots))
    return Cells(first, lasting, np.ones_like(first))


def swinging_cells(slots: int, period: int, parts: int, growth: float) -> Cells:
    """Divide the slots after a step from which on the torque swings.

    Parameters
    ----------
    slots
        How many there are.
    period
        How many a period has.
    parts
        Into how many a period is divided.
    growth
        Factor by which the number of periods grows that cells are spread over.
    """
    part = max(1, period // parts)
    begun = cells(min(slots, period), growth, part)
    edges = np.unique(np.round(np.linspace(0, period, min(parts, period) + 1)).astype(np.intp))
    whole = slots // period
    place, groups = 1, [begun]
    while place < whole:
        count = min(max(1, int(place * (growth - 1))), whole - place)
        repeats = np.full(len(edges) - 1, count)
        groups.append(Cells(place * period + edges[:-1], np.diff(edges), repeats))
        place += count
    left = slots - whole * period if whole else 0
    rest = edges[edges < left]
    ends = np.minimum(edges[1:], left)[: len(rest)]
    groups.append(Cells(whole * period + rest, ends - rest, np.ones_like(rest)))
    first, lasting, repeats = (
        np.concatenate([getattr(group, name) for group in groups])
        for name in ("first", "slots", "repeats")
    )
    return Cells(first, lasting, repeats, period)
