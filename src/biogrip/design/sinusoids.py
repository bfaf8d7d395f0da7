"""Trains of sinusoids, each on a held torque and of a frequency of its own, and a hold."""

import numpy as np

from biogrip.arrays import Array
from biogrip.design.steps import between, how_many
from biogrip.design.waveform import Limits, Waveform, swinging, until_the_end

SHARES = 10
"""Numbers between 0 and 1 that make a train of sinusoids."""

# The information matrix of four parameters has ten numbers: more frequencies add nothing.
_MOST = 10
_MOST_PERIODS = 10_000
_FEWEST_SLOTS = 8


def sinusoids(shares: Array, limits: Limits) -> Waveform:
    """Convert numbers between 0 and 1 to sinusoids on held torques, and a hold until the end.

    Periods grow or shrink by the same factor from one sinusoid to the next, as in a chirp; held
    torques and amplitudes change linearly. A torque stays between zero and the largest. The numbers
    are that of sinusoids, logarithmically; length of the train, likewise; period of the first and
    the last one, likewise, from eight readings at the fastest to the train's length; how their
    durations grow with their periods, from not at all to as much; held torque of the first and the
    last one; amplitudes there, as shares of the largest possible; torque of the hold.
    """
    length, period_0, period_1, growing, mean_0, mean_1, swing_0, swing_1, last = shares[1:]
    unit, slot = limits.shortest_s, limits.slot_s
    count = how_many(shares[0], min(_MOST, limits.most_steps - 1, int(limits.longest_s / unit) - 1))
    along = np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1)
    # A sinusoid lasts a unit at least.
    length_s = between(length, unit * count, limits.longest_s - unit * (1 + count))
    shortest = _FEWEST_SLOTS * slot
    periods = shortest * max(1.0, length_s / shortest) ** (period_0 + (period_1 - period_0) * along)
    durations = np.floor(periods**growing / np.sum(periods**growing) * length_s / unit) * unit
    durations = np.maximum(durations, unit)
    periods = np.maximum(periods, durations / _MOST_PERIODS)
    # An even number of slots, so that a burst can sample opposite half-periods in turn.
    periods = 2 * np.ceil(periods / (2 * slot) * (1 - 1e-9)) * slot
    mean = mean_0 + (mean_1 - mean_0) * along
    amplitudes = (swing_0 + (swing_1 - swing_0) * along) * np.minimum(mean, 1 - mean)
    return until_the_end(swinging(durations, mean, amplitudes, periods), last, limits)
