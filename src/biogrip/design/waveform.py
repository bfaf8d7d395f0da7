"""Torque against time, before it is scaled: stretches that are held, change linearly, or swing."""

from dataclasses import dataclass, fields, replace

import numpy as np

from biogrip.arrays import Array, BoolArray


@dataclass(frozen=True)
class Limits:
    """What an actuator and the patience of the experimenter allow.

    Parameters
    ----------
    longest_s
        Duration of the experiment.
    shortest_s
        Of a stretch; all durations are whole multiples of it.
    most_steps
        How many stretches there are at most.
    slot_s
        Time between two readings at the fastest; periods are whole multiples of it.
    """

    longest_s: float
    shortest_s: float
    most_steps: int
    slot_s: float


@dataclass(frozen=True)
class Waveform:
    """Stretches that follow one another.

    Parameters
    ----------
    durations_s : (n_steps,)
    levels, ends : (n_steps,)
        Torque at the beginning and at the end of a stretch, linear between, in shares of the
        largest.
    amplitudes : (n_steps,)
        Of a sinusoid on top of it, which starts at its mean, rising.
    periods_s : (n_steps,)
        Of the sinusoids; infinite where nothing swings.
    """

    durations_s: Array
    levels: Array
    ends: Array
    amplitudes: Array
    periods_s: Array

    @property
    def slopes(self) -> Array:
        """Change of the torque in a second, (n_steps,)."""
        return (self.ends - self.levels) / self.durations_s

    @property
    def swings(self) -> BoolArray:
        """Which stretches swing, (n_steps,)."""
        return self.amplitudes > 0

    @property
    def highest(self) -> float:
        """Largest torque of all."""
        return float(np.max(np.maximum(self.levels, self.ends) + self.amplitudes))

    @property
    def in_shares(self) -> "Waveform":
        """The same, with 1 as the largest torque."""
        parts = {name: getattr(self, name) / self.highest for name in _TORQUES}
        return replace(self, **parts)


_TORQUES = ("levels", "ends", "amplitudes")


def held(durations_s: Array, levels: Array) -> Waveform:
    """Hold torques one after the other."""
    return linear(durations_s, levels, levels)


def linear(durations_s: Array, levels: Array, ends: Array) -> Waveform:
    """Change torques linearly, one after the other."""
    return Waveform(durations_s, levels, ends, np.zeros_like(levels), np.full_like(levels, np.inf))


def swinging(durations_s: Array, levels: Array, amplitudes: Array, periods_s: Array) -> Waveform:
    """Hold torques one after the other, with a sinusoid on top where the amplitude is not zero."""
    periods_s = np.where(amplitudes > 0, periods_s, np.inf)
    return Waveform(durations_s, levels, levels, amplitudes, periods_s)


def tidied(waveform: Waveform) -> Waveform:
    """Leave out stretches that do not last, and join what is held at the same torque."""
    there = waveform.durations_s > 0
    parts = {field.name: getattr(waveform, field.name)[there] for field in fields(waveform)}
    levels, ends = parts["levels"], parts["ends"]
    still = (levels == ends) & (parts["amplitudes"] == 0)
    joined = still[1:] & still[:-1] & (levels[1:] == levels[:-1])
    first = np.append(True, ~joined)
    sums: Array = np.bincount(np.cumsum(first) - 1, parts.pop("durations_s")).astype(float)
    return Waveform(sums, **{name: part[first] for name, part in parts.items()})


def until_the_end(waveform: Waveform, level: float, limits: Limits) -> Waveform:
    """Round durations to whole multiples of the shortest, and hold a torque until the end."""
    unit = limits.shortest_s
    durations = np.maximum(np.round(waveform.durations_s / unit), 0) * unit
    last = max(round((limits.longest_s - durations.sum()) / unit), 0) * unit
    return tidied(
        Waveform(
            np.append(durations, last),
            np.append(waveform.levels, level),
            np.append(waveform.ends, level),
            np.append(waveform.amplitudes, 0.0),
            np.append(waveform.periods_s, np.inf),
        )
    )
