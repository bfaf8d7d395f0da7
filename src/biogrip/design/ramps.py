"""Trains of ramps, for a generator that cannot jump, and a hold after them."""

import numpy as np

from biogrip.arrays import Array
from biogrip.design.steps import cycles, how_many
from biogrip.design.waveform import Limits, Waveform, linear, until_the_end

SHARES = 11
"""Numbers between 0 and 1 that make a train of ramps."""


def ramps(shares: Array, limits: Limits) -> Waveform:
    """Convert numbers between 0 and 1 to a train of trapezia or triangles, and a hold.

    A cycle rises to its high level, stays, falls to its low level, and stays. The torque never
    jumps: no ramp is shorter than the shortest stretch, which is also the duration of the last
    ramp, to the hold. The numbers are as in `steps`, the duty shared between rise with high level
    and fall with low one; then the share of the rise in the first of these, and of the fall in the
    second (nearly one: all of it, a triangle).
    """
    rise, fall = (min(1.0, share / 0.9) for share in shares[9:])
    unit = limits.shortest_s
    parts = 2 + (rise < 1) + (fall < 1)
    # Room for the last ramp and the hold beside the cycles, whose ramps are rounded up.
    room = (limits.longest_s / unit - 2) / (parts + 2)
    count = how_many(shares[0], min((limits.most_steps - 2) // parts, int(room)))
    whole = limits.longest_s - 2 * unit * (1 + count)
    lasting, high, low = cycles(shares[1:8], count, parts * unit * count, whole)
    lasting = np.maximum(np.floor(lasting / unit), 0)
    ramps = 1 + np.floor(lasting * (rise, fall))
    stays = np.maximum(lasting - ramps, 0) * (rise < 1, fall < 1)
    durations = np.stack((ramps[:, 0], stays[:, 0], ramps[:, 1], stays[:, 1]), axis=1).ravel()
    levels = np.stack((np.append(0.0, low[:-1]), high, high, low), axis=1).ravel()
    ends = np.stack((high, high, low, low), axis=1).ravel()
    train = linear(
        unit * np.append(durations, 1),
        np.append(levels, low[-1]),
        np.append(ends, shares[8]),
    )
    return until_the_end(train, shares[8], limits)
