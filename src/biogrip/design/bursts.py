"""Conversion of numbers of readings in cells to bursts of a camera."""

from collections.abc import Iterator, Sequence

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.time_bins import TimeBins
from biogrip.experiment.sampling import Burst

_Run = tuple[int, int, int]
"""First slot, slots from one reading to the next, readings."""


def whole(samples: Array, capacity: Array) -> IntArray:
    """Round numbers of readings to integers with the same sum."""
    counts = np.floor(samples + 1e-9)
    missing = round(float(samples.sum() - counts.sum()))
    # A linear program may have overfilled cells by its tolerance; these get no more.
    room = counts < capacity
    order = np.argsort(-np.where(room, samples - counts, -1.0), kind="stable")
    counts[order[:missing]] += 1
    return counts.astype(np.intp)


def make_bursts(
    each: Sequence[TimeBins], starts: IntArray, counts: IntArray, fastest_Hz: float
) -> tuple[Burst, ...]:
    """Convert readings of cells, (n_cells,), to bursts; successive full cells share a burst.

    There are cells after each step, which begins at a slot, and `fastest_Hz` slots per second.
    """
    runs: list[_Run] = []
    place = 0
    for start, own in zip(starts.tolist(), each, strict=True):
        here = counts[place : place + len(own.first)]
        place += len(own.first)
        found = _repeated(own, here) if own.stride else _once(own, here)
        for first, stride, count in found:
            begins = start + first
            last = runs[-1] if runs else None
            if last and last[1] == stride and begins == last[0] + stride * last[2]:
                runs[-1] = (last[0], stride, last[2] + count)
            else:
                runs.append((begins, stride, count))
    return tuple(
        Burst(begins / fastest_Hz, fastest_Hz / stride, count) for begins, stride, count in runs
    )


def _once(own: TimeBins, counts: IntArray) -> Iterator[_Run]:
    """Yield runs of readings in the middle of successive cells."""
    for first, slots, count in zip(
        own.first.tolist(), own.slots.tolist(), counts.tolist(), strict=True
    ):
        if count:
            stride = slots // count
            yield first + (slots - 1 - stride * (count - 1)) // 2, stride, count


def _repeated(own: TimeBins, counts: IntArray) -> list[_Run]:
    """Return runs of readings of cells that repeat in every period, cells in turn if few."""
    slots: list[int] = []
    place, used = -1, 0
    for first, length, repeats, count in zip(
        own.first.tolist(), own.slots.tolist(), own.repeats.tolist(), counts.tolist(), strict=True
    ):
        if first // own.stride != place:
            place, used = first // own.stride, 0
        if not count:
            continue
        if used + count > repeats:
            used = 0
        for turn in range(min(count, repeats)):
            several = (count - turn - 1) // repeats + 1
            apart = length // several
            begins = first + (length - 1 - apart * (several - 1)) // 2
            begins += own.stride * (used + turn)
            slots += range(begins, begins + apart * several, apart)
        used += min(count, repeats)
    return _runs(sorted(slots))


def _runs(slots: Sequence[int]) -> list[_Run]:
    """Divide ascending slots into runs that are evenly spaced."""
    runs: list[_Run] = []
    for slot in slots:
        first, stride, count = runs[-1] if runs else (slot, 0, 0)
        apart = slot - (first + stride * (count - 1))
        if count == 1 or (count > 1 and apart == stride):
            runs[-1] = (first, slot - first if count == 1 else stride, count + 1)
        else:
            runs.append((slot, 1, 1))
    return runs
