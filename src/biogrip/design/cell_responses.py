"""Sensitivities, rotations and forces of plausible samples under a torque, in cells of time."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.time_bins import TimeBins, periodic_time_bins
from biogrip.design.views import Moving, Views
from biogrip.design.waveform import Waveform

# Under sinusoids: parts of a period, and growth of the number of periods of a cell.
_PARTS, _PERIODS = 12, 2.0
# Cells at the end of a step, each half as long as the one before: readings are often best there.
_ENDS = 6
# Largest excess of a sinusoid over its value in the middle of the nearest part, per amplitude.
_BETWEEN = 1 - np.cos(np.pi / _PARTS)


@dataclass(frozen=True)
class CellResponses:
    """Responses of plausible samples to a torque whose largest is 1 N m, in cells."""

    sensitivity: Array
    """d phi / d log p in rad, (n, n_parameters, n_cells)."""
    capacity: Array
    """Largest number of readings in each cell, (n_cells,)."""
    steps: IntArray
    """Step that each cell comes after, (n_cells,)."""
    places: IntArray
    """Number of each cell among those of a step, (n_cells,)."""
    middle_s: Array
    """Middle of each cell, (n_cells,)."""
    lasting_s: Array
    """Length of each, over all its repetitions, (n_cells,)."""
    turned_rad: float
    """Largest rotation."""
    pull: float
    """Largest shortfall of a sample's force below its margin, relative to its largest; without jaws
    0."""


@dataclass(frozen=True)
class _Part:
    """Responses in some steps: their indices, sensitivities, and forces of each sample.

    Of each cell, step and number there.
    """

    steps: IntArray
    places: tuple[IntArray, IntArray]
    after_s: Array
    lasting_s: Array
    sensitivity: Array
    capacity: Array
    turned_rad: float
    largest_N: Array
    lowest_N: Array


def compute_cell_responses(
    views: Views, time_bins: TimeBins, waveform: Waveform, fastest_Hz: float, margin: float
) -> CellResponses:
    """Compute the responses of plausible samples to a torque in N m if its largest is 1, in cells.

    The cells after a step are longer than any step; there are `fastest_Hz` slots per second. The
    margin is that of a sample's force, relative to its largest.
    """
    moving = views.under(waveform)
    slots = np.round(waveform.durations_s * fastest_Hz).astype(np.intp)
    starts_s = np.append(0.0, np.cumsum(waveform.durations_s))
    parts = []
    if not waveform.swings.all():
        steady = np.flatnonzero(~waveform.swings)
        parts.append(_compute_responses(moving, steady, time_bins, slots[steady, None], fastest_Hz))
    for k in np.flatnonzero(waveform.swings):
        period = round(waveform.periods_s[k] * fastest_Hz)
        own = periodic_time_bins(int(slots[k]), period, _PARTS, _PERIODS)
        parts.append(_compute_responses(moving, np.array([k]), own, slots[[k], None], fastest_Hz))
    largest = np.max([part.largest_N for part in parts], axis=0)
    steps = np.concatenate([part.steps for part in parts])
    lowest = np.concatenate([part.lowest_N for part in parts], axis=1)
    lowest = np.minimum(lowest, moving.last_force[:, steps])
    least = np.where(steps > 0, margin, 0.0) * largest[:, None]
    turned = max(part.turned_rad for part in parts)
    of_cells = np.concatenate([part.places[0] for part in parts])
    return CellResponses(
        np.concatenate([part.sensitivity for part in parts], axis=2),
        np.concatenate([part.capacity for part in parts]),
        of_cells,
        np.concatenate([part.places[1] for part in parts]),
        starts_s[of_cells] + np.concatenate([part.after_s for part in parts]),
        np.concatenate([part.lasting_s for part in parts]),
        max(turned, float(np.max(np.abs(moving.last_rotation)))),
        float(np.max((least - lowest) / largest[:, None])) if views.instrument.has_jaws else 0.0,
    )


def _compute_responses(
    moving: Moving,
    steps: IntArray,
    time_bins: TimeBins,
    slots: IntArray,
    fastest_Hz: float,
) -> _Part:
    """Compute responses in steps with given numbers of slots; in a sinusoid if cells repeat."""
    swings = time_bins.stride > 0
    after_s = time_bins.middle / fastest_Hz
    view = moving.respond(steps, after_s if swings else None)
    covered = time_bins.middle < slots
    turned = float(np.max(np.abs(view.rotation), where=covered, initial=0.0))
    largest = np.max(view.force, axis=(1, 2), where=covered, initial=0.0)
    lowest = np.min(view.force, axis=2, where=covered, initial=np.inf)
    of_each = (len(steps), len(after_s))
    after_s, sensitivity = np.broadcast_to(after_s, of_each), view.sensitivity
    if swings:
        turned += _BETWEEN * float(np.ptp(view.rotation, axis=2).max()) / 2
        lowest -= _BETWEEN * np.ptp(view.force, axis=2) / 2
        capacity = np.clip(slots - time_bins.first, 0, time_bins.capacity) * covered
        longest = np.maximum(time_bins.stride * time_bins.repeats, time_bins.slots)
        longest = np.broadcast_to(longest, of_each)
    else:
        whole = time_bins.first + time_bins.slots <= slots
        first, lasting = _ends(time_bins, whole.sum(axis=1), slots)
        ends_s = np.sqrt(first * (first + lasting - 1.0)) / fastest_Hz
        sensitivity = np.append(sensitivity, moving.respond(steps, ends_s).sensitivity, axis=3)
        after_s = np.append(after_s, ends_s, axis=1)
        longest = capacity = np.append(time_bins.slots * whole, lasting, axis=1)
    there = capacity > 0
    rows, places = np.nonzero(there)
    found = sensitivity[..., there], capacity[there].astype(float)
    at = (steps[rows], places), after_s[there], longest[there] / fastest_Hz
    return _Part(steps, *at, *found, turned, largest, lowest)


def _ends(time_bins: TimeBins, whole: IntArray, slots: IntArray) -> tuple[IntArray, IntArray]:
    """Divide what is left of steps after their whole cells, halving it again and again.

    Of steps with numbers of whole cells, (n_steps,), and of slots, (n_steps, 1).

    Returns
    -------
    first, lasting : (n_steps, _ENDS)
        First slot of each cell, and number of slots, which may be zero.
    """
    finishes = time_bins.first + time_bins.slots
    begins = np.append(time_bins.first[:1], finishes)[whole, None]
    left = (slots - begins) // 2 ** np.arange(_ENDS)
    return slots - left, left - np.append(left[:, 1:], np.zeros_like(begins), axis=1)
