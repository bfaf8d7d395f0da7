"""Breakpoints of what is held, between which a generator draws straight lines."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import Phase, largest_load, torque_history

FINENESS = 1e-4
"""Largest deviation from a ramp or a sinusoid, in shares of the largest value that is held: the
last of the four digits that designs set."""

# Rounding relative to the largest value, and to the distance between two breakpoints.
_NOTHING, _SAME_INSTANT = 1e-12, 1e-6
_FEWEST_PARTS = 16


def breakpoints(phases: Sequence[Phase], *, root: bool) -> Iterator[tuple[Array, Array]]:
    """Yield times in s and values of each phase, from its start to its end, (n_points,) each.

    Of phases in which both arms are driven alike. With `root` the straight lines are those of a
    voltage, whose square the value goes with.
    """
    largest = abs(largest_load(phases))
    for start_s, phase in zip(torque_history(tuple(phases)).time_s, phases, strict=True):
        elapsed_s = _elapsed(phase, largest, root=root)
        values = phase.left.at(elapsed_s)
        # What ends at zero ends there but for rounding, whose root is no rounding.
        values[np.abs(values) < _NOTHING * largest] = 0.0
        yield start_s + elapsed_s, values


def _elapsed(phase: Phase, largest: float, *, root: bool) -> Array:
    """Return times since the start of a phase between which lines are straight enough."""
    ends = np.array([0.0, phase.duration_s])
    for harmonic in phase.left.harmonics:
        return _of_sinusoid(
            phase.duration_s, harmonic.frequency_Hz, harmonic.amplitude_Nm / largest
        )
    if root and phase.left.slope_Nm_per_s:
        return _of_root(phase.duration_s, np.maximum(phase.left.at(ends) / largest, 0.0))
    return ends


def _of_root(duration_s: float, shares: Array) -> Array:
    """Divide a ramp from one share of the largest value to another at even steps of its root.

    Between points whose roots differ by d, the square of the straight line lies below the ramp, by
    d^2/4 at most, in the middle.
    """
    first, last = np.sqrt(shares)
    count = max(1, math.ceil(abs(last - first) / (2 * math.sqrt(FINENESS))))
    roots = first + (last - first) * np.arange(count + 1) / count
    return duration_s * (roots**2 - first**2) / (last**2 - first**2)


def _of_sinusoid(duration_s: float, frequency_Hz: float, amplitude: float) -> Array:
    """Divide periods evenly, and the rest of one; the amplitude is a share of the largest value.

    Between points h apart in phase, a straight line deviates by a h^2/8 at most, and so does its
    square from a value that goes with it, since that of the root is curved less where it bends up.
    """
    parts = math.ceil(2 * math.pi * math.sqrt(amplitude / (8 * FINENESS)))
    # Of four, so that the highest and the lowest value are met.
    rate_Hz = frequency_Hz * 4 * math.ceil(max(parts, _FEWEST_PARTS) / 4)
    count = math.floor(duration_s * rate_Hz + _SAME_INSTANT)
    elapsed_s = np.arange(count + 1) / rate_Hz
    if duration_s * rate_Hz - count <= _SAME_INSTANT:
        elapsed_s[-1] = duration_s
        return elapsed_s
    return np.append(elapsed_s, duration_s)
