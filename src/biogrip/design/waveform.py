"""Unscaled torque against time: stretches that are constant, linear or sinusoidal."""

from dataclasses import dataclass, fields, replace

import numpy as np

from biogrip.arrays import Array, BoolArray


@dataclass(frozen=True)
class Limits:
    """Limits of the torque's stretches."""

    longest_s: float
    """Duration of the experiment."""
    shortest_s: float
    """Shortest duration of a stretch; all durations are whole multiples of it."""
    most_steps: int
    """Largest number of stretches."""
    slot_s: float
    """Time between two readings at the fastest; periods are whole multiples of it."""


@dataclass(frozen=True)
class Waveform:
    """Torque against time as successive stretches."""

    durations_s: Array
    """Durations of the stretches, (n_steps,)."""
    levels: Array
    """Torque at the beginning of a stretch, (n_steps,), in shares of the largest."""
    ends: Array
    """Torque at its end, linear between, (n_steps,)."""
    amplitudes: Array
    """Amplitudes of sinusoids on top, which start at their mean, rising, (n_steps,)."""
    periods_s: Array
    """Periods of the sinusoids, (n_steps,); infinite where there is none."""

    @property
    def slopes(self) -> Array:
        """Change of the torque per second, (n_steps,)."""
        return (self.ends - self.levels) / self.durations_s

    @property
    def swings(self) -> BoolArray:
        """True for stretches with a sinusoid, (n_steps,)."""
        return self.amplitudes > 0

    @property
    def only_steps(self) -> bool:
        """True if the torque only changes at steps."""
        return bool(np.all(self.levels == self.ends)) and not self.swings.any()

    @property
    def highest(self) -> float:
        """Largest torque of all."""
        return float(np.max(np.maximum(self.levels, self.ends) + self.amplitudes))

    @property
    def jumps(self) -> Array:
        """Jump of the torque at the beginning of each stretch, (n_steps,)."""
        swung = np.where(self.swings, np.sin(2 * np.pi * self.durations_s / self.periods_s), 0.0)
        before = self.ends + self.amplitudes * swung
        return self.levels - np.append(0.0, before[:-1])

    @property
    def in_shares(self) -> "Waveform":
        """The same waveform, scaled to a largest torque of 1."""
        parts = {name: getattr(self, name) / self.highest for name in _TORQUES}
        return replace(self, **parts)


_TORQUES = ("levels", "ends", "amplitudes")


def hold(durations_s: Array, levels: Array) -> Waveform:
    """Return a waveform that holds torques one after the other."""
    return linear(durations_s, levels, levels)


def linear(durations_s: Array, levels: Array, ends: Array) -> Waveform:
    """Return a waveform of torques that change linearly, one after the other."""
    return Waveform(durations_s, levels, ends, np.zeros_like(levels), np.full_like(levels, np.inf))


def swinging(durations_s: Array, levels: Array, amplitudes: Array, periods_s: Array) -> Waveform:
    """Return a waveform of held torques, with a sinusoid on top where the amplitude is not zero."""
    periods_s = np.where(amplitudes > 0, periods_s, np.inf)
    return Waveform(durations_s, levels, levels, amplitudes, periods_s)


def tidied(waveform: Waveform) -> Waveform:
    """Remove stretches of no duration, and join successive holds of the same torque."""
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
