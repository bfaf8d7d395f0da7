"""Stretches of time after a step in which what is seen hardly changes.

A step is divided into slots, one for every reading that the sampling is fast enough for. At first
a cell is a slot, for arms ring; then cells grow by the same factor.
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
        How many slots each has.
    """

    first: IntArray
    slots: IntArray

    @property
    def middle(self) -> Array:
        """Geometric means of the first and the last slot, (n_cells,)."""
        return np.sqrt(self.first * (self.first + self.slots - 1.0))


def cells(slots: int, growth: float) -> Cells:
    """Divide the first so many slots after a step, of which the last is the next step's.

    Parameters
    ----------
    slots
        How many there are.
    growth
        Factor by which cells become longer.
    """
    firsts = list(range(1, min(_SINGLE, slots)))
    place = float(_SINGLE)
    while place < slots:
        firsts.append(int(place))
        place = max(place * growth, place + 1.0)
    first = np.array(firsts, dtype=np.intp)
    return Cells(first, np.diff(np.append(first, slots)))
