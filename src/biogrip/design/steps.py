"""Torques made of few numbers: trains of steps, up and down or only up, and a hold after them."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array

# How much longer the last cycle of a train is than its first, at most.
_STRETCHED = 1e3

SHARES = 9
"""Numbers between 0 and 1 that make a train."""


@dataclass(frozen=True)
class Limits:
    """What an actuator and the patience of the experimenter allow.

    Parameters
    ----------
    longest_s
        Duration of the experiment.
    shortest_s
        Of a step; all durations are whole multiples of it.
    most_steps
        How many steps there are at most.
    """

    longest_s: float
    shortest_s: float
    most_steps: int


@dataclass(frozen=True)
class Steps:
    """Torques that are held one after the other.

    Parameters
    ----------
    durations_s : (n_steps,)
    levels : (n_steps,)
        Torques, in shares of the largest.
    """

    durations_s: Array
    levels: Array


def train(shares: Array, limits: Limits) -> Steps:
    """Turn numbers between 0 and 1 into a train of cycles, and a hold until the end.

    A cycle is a high level and a low one. Both change linearly over the train, cycles become
    longer or shorter by the same factor.

    Parameters
    ----------
    shares : (SHARES,)
        Number of cycles, logarithmically; length of the train, likewise; factor from the first
        cycle to the last, likewise; share of the high level in a cycle (nearly one: all of it);
        high level at the beginning and the end; low level there, as a share of the high one;
        torque of the hold.
    limits
        What is allowed.
    """
    number, length, stretch, duty, high_0, high_1, low_0, low_1, held = shares
    most = max(1, (limits.most_steps - 1) // 2)
    count = round(float(most**number))
    along = np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1)
    high = high_0 + (high_1 - high_0) * along
    low = high * (low_0 + (low_1 - low_0) * along)
    shortest = 2 * limits.shortest_s * count
    whole = limits.longest_s - limits.shortest_s
    length_s = shortest * (whole / shortest) ** length if shortest < whole else whole
    cycles = _STRETCHED ** ((2 * stretch - 1) * along)
    cycles *= length_s / cycles.sum()
    part = min(1.0, duty / 0.9)
    durations = np.stack((part * cycles, (1 - part) * cycles), axis=1).ravel()
    levels = np.stack((high, low), axis=1).ravel()
    unit = limits.shortest_s
    durations = np.maximum(np.round(durations / unit), 0) * unit
    last = max(round((limits.longest_s - durations.sum()) / unit), 0) * unit
    durations, levels = np.append(durations, last), np.append(levels, held)
    there = durations > 0
    return _joined(durations[there], levels[there])


def _joined(durations_s: Array, levels: Array) -> Steps:
    """Join what is held at the same torque."""
    changes = np.append(True, levels[1:] != levels[:-1])
    groups = np.cumsum(changes) - 1
    sums: Array = np.bincount(groups, durations_s).astype(float)
    return Steps(sums, levels[changes])
