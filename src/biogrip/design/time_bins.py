"""Cells: stretches of time after a step in which responses hardly change.

A step is divided into slots, one for every reading at the fastest rate. At first a cell is a
slot, for arms ring; then cells grow by the same factor. Under a sinusoidal torque, a cell is a
part of a period, and from the second period on the same part of several successive periods:
once ringing has decayed, their responses are the same.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray

_SINGLE = 24
# Slots after a step until arms are at rest: of a soft sample and a fast camera.
_RINGING = 3000


@dataclass(frozen=True)
class TimeBins:
    """Cells after a step."""

    first: IntArray
    """First slot of each, (n_cells,); slot j is j slots after the step."""
    slots: IntArray
    """Number of successive slots in each, (n_cells,)."""
    repeats: IntArray
    """Number of repetitions of these slots in each, (n_cells,)."""
    stride: int = 0
    """Number of slots from one repetition to the next."""

    @property
    def capacity(self) -> IntArray:
        """Largest number of readings in each cell, (n_cells,)."""
        return self.slots * self.repeats

    @property
    def begins(self) -> IntArray:
        """First slot of the middle repetition, (n_cells,)."""
        return self.first + self.stride * ((self.repeats - 1) // 2)

    @property
    def finishes(self) -> IntArray:
        """Last slot of the middle repetition, (n_cells,)."""
        return self.begins + self.slots - 1

    @property
    def middle(self) -> Array:
        """Geometric mean of first and last slot, in the middle repetition, (n_cells,)."""
        return np.sqrt(self.begins * (self.begins + self.slots - 1.0))


def time_bins(
    slots: int, growth: float, longest: int | None = None, *, ringing: float | None = None
) -> TimeBins:
    """Divide the slots up to the next step into cells that grow by a factor, up to a longest.

    While arms may ring they grow by another factor if one is given.
    """
    firsts = list(range(1, min(_SINGLE, slots)))
    place = float(_SINGLE)
    while place < slots:
        firsts.append(int(place))
        factor = ringing if ringing is not None and place < _RINGING else growth
        further = place * factor if longest is None else min(place * factor, place + longest)
        place = max(further, place + 1.0)
    first = np.array(firsts, dtype=np.intp)
    lasting = np.diff(np.append(first, slots))
    return TimeBins(first, lasting, np.ones_like(first))


def with_fine_end(bins: TimeBins) -> TimeBins:
    """Halve the last cell again and again towards its last slot, where readings are often best."""
    begins, left = int(bins.first[-1]), int(bins.slots[-1])
    first = bins.first[:-1].tolist()
    end = begins + left
    while left > 0:
        first.append(end - left)
        left //= 2
    return TimeBins(np.array(first), np.diff([*first, end]), np.ones(len(first), dtype=np.intp))


def periodic_time_bins(slots: int, period: int, parts: int, growth: float) -> TimeBins:
    """Divide the slots of a sinusoidal torque into cells that repeat in successive periods.

    Each period has some parts; the number of periods over which cells repeat grows by a factor.
    """
    part = max(1, period // parts)
    begun = time_bins(min(slots, period), growth, part)
    edges = np.unique(np.round(np.linspace(0, period, min(parts, period) + 1)).astype(np.intp))
    whole = slots // period
    place, groups = 1, [begun]
    while place < whole:
        count = min(max(1, int(place * (growth - 1))), whole - place)
        repeats = np.full(len(edges) - 1, count)
        groups.append(TimeBins(place * period + edges[:-1], np.diff(edges), repeats))
        place += count
    left = slots - whole * period if whole else 0
    rest = edges[edges < left]
    ends = np.minimum(edges[1:], left)[: len(rest)]
    groups.append(TimeBins(whole * period + rest, ends - rest, np.ones_like(rest)))
    first, lasting, repeats = (
        np.concatenate([getattr(group, name) for group in groups])
        for name in ("first", "slots", "repeats")
    )
    return TimeBins(first, lasting, repeats, period)
