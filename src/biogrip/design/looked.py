"""What the search sees of plausible samples under a torque, in cells of time."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.cells import Cells, swinging_cells
from biogrip.design.views import Moving, Views
from biogrip.design.waveform import Waveform

# Where the torque swings: parts of a period, and how the number of periods of a cell grows.
_PARTS, _PERIODS = 12, 2.0
# By how much of half its height a sinusoid may be higher than in the middle of the nearest part.
_BETWEEN = 1 - np.cos(np.pi / _PARTS)
# While only few instants are looked at, the force must not come nearer to zero than this.
_MARGIN = 2e-3


@dataclass(frozen=True)
class Looked:
    """What is seen under a torque whose largest is 1 N m.

    Parameters
    ----------
    sensitivity : (n, n_parameters, n_cells)
        d phi / d log p in rad.
    capacity : (n_cells,)
        How many readings a cell has room for.
    turned_rad
        Largest rotation.
    pull
        How far the force of a sample comes below its margin, as a share of its largest.
    """

    sensitivity: Array
    capacity: Array
    turned_rad: float
    pull: float


@dataclass(frozen=True)
class _Part:
    """Some steps: where they stand, what is told, and forces of each sample in each of them."""

    steps: IntArray
    sensitivity: Array
    capacity: Array
    turned_rad: float
    largest_N: Array
    lowest_N: Array


def looked(views: Views, cells: Cells, waveform: Waveform, fastest_Hz: float) -> Looked:
    """Look at plausible samples under a torque.

    Parameters
    ----------
    views
        Of the samples, at the middle of the cells.
    cells
        After any step, longer than any.
    waveform
        In N m, if its largest is 1.
    fastest_Hz
        How many slots a second has.
    """
    moving = views.under(waveform)
    slots = np.round(waveform.durations_s * fastest_Hz).astype(np.intp)
    parts = []
    if not waveform.swings.all():
        steady = np.flatnonzero(~waveform.swings)
        parts.append(_looked(moving, steady, cells, slots[steady, None]))
    for k in np.flatnonzero(waveform.swings):
        period = round(waveform.periods_s[k] * fastest_Hz)
        own = swinging_cells(int(slots[k]), period, _PARTS, _PERIODS)
        times = own.middle / fastest_Hz
        parts.append(_looked(moving, np.array([k]), own, slots[[k], None], times))
    largest = np.max([part.largest_N for part in parts], axis=0)
    steps = np.concatenate([part.steps for part in parts])
    lowest = np.concatenate([part.lowest_N for part in parts], axis=1)
    lowest = np.minimum(lowest, moving.last_force[:, steps])
    margin = np.where(steps > 0, _MARGIN, 0.0) * largest[:, None]
    turned = max(part.turned_rad for part in parts)
    return Looked(
        np.concatenate([part.sensitivity for part in parts], axis=2),
        np.concatenate([part.capacity for part in parts]),
        max(turned, float(np.max(np.abs(moving.last_rotation)))),
        float(np.max((margin - lowest) / largest[:, None])),
    )


def _looked(
    moving: Moving, steps: IntArray, cells: Cells, slots: IntArray, times_s: Array | None = None
) -> _Part:
    """Look at steps that have so many slots each; at sinusoids if times are given."""
    view = moving.seen(steps, times_s)
    seen = cells.middle < slots
    turned = float(np.max(np.abs(view.rotation), where=seen, initial=0.0))
    largest = np.max(view.force, axis=(1, 2), where=seen, initial=0.0)
    lowest = np.min(view.force, axis=2, where=seen, initial=np.inf)
    if times_s is not None:
        turned += _BETWEEN * float(np.ptp(view.rotation, axis=2).max()) / 2
        lowest -= _BETWEEN * np.ptp(view.force, axis=2) / 2
    room = (np.clip(slots - cells.first, 0, cells.capacity) * seen).astype(float).ravel()
    told = view.sensitivity.reshape(*view.sensitivity.shape[:2], -1)
    there = room > 0
    return _Part(steps, told[..., there], room[there], turned, largest, lowest)
