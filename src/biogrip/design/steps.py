"""Trains of steps: up and down or only up, and a hold after them."""

import numpy as np

from biogrip.arrays import Array
from biogrip.design.waveform import Limits, Waveform, hold, until_the_end

# Largest ratio of the lengths of the last and the first cycle of a train, or its reciprocal.
_STRETCHED = 1e3

SHARES = 9
"""Numbers between 0 and 1 that make a train of steps."""


def steps(shares: Array, limits: Limits) -> Waveform:
    """Convert numbers between 0 and 1 to a train of cycles, and a hold until the end.

    A cycle is a high level and a low one. Both change linearly over the train, cycles become longer
    or shorter by the same factor. The numbers are that of cycles, logarithmically; length of the
    train, likewise; factor from the first cycle to the last, likewise; share of the high level in a
    cycle (nearly one: all of it); high level at the beginning and the end; low level there, as a
    share of the high one; torque of the hold.
    """
    count = how_many(shares[0], (limits.most_steps - 1) // 2)
    whole = limits.longest_s - limits.shortest_s
    durations, high, low = cycles(shares[1:8], count, 2 * limits.shortest_s * count, whole)
    levels = np.stack((high, low), axis=1).ravel()
    return until_the_end(hold(durations.ravel(), levels), shares[8], limits)


def how_many(share: float, most: int) -> int:
    """Convert a share between 0 and 1 to an integer from one to `most`, logarithmically."""
    return round(float(max(1, most) ** share))


def cycles(
    shares: Array, count: int, shortest_s: float, longest_s: float
) -> tuple[Array, Array, Array]:
    """Divide a train into cycles, each with one part at its high and one at its low level.

    The shares, (7,), are those of `steps`, from the length to the low level. Returns durations,
    (n_cycles, 2), and high and low levels, (n_cycles,) each.
    """
    length, stretch, duty, high_0, high_1, low_0, low_1 = shares
    along = np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1)
    high = high_0 + (high_1 - high_0) * along
    low = high * (low_0 + (low_1 - low_0) * along)
    durations = _STRETCHED ** ((2 * stretch - 1) * along)
    durations *= between(length, shortest_s, longest_s) / durations.sum()
    part = min(1.0, duty / 0.9)
    return np.stack((part * durations, (1 - part) * durations), axis=1), high, low


def between(share: float, low: float, high: float) -> float:
    """Interpolate logarithmically between two numbers."""
    return low * (high / low) ** share if low < high else high
