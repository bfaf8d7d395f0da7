"""Random small changes of trains of steps: levels, times, and how many there are."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.waveform import Limits, Waveform, hold

# Largest typical change of a level or of the logarithm of a time, and how much smaller the
# smallest is.
_LARGEST, _SMALLER = 0.3, 1e-2
# Steps of a train that is drawn at random, and the part of the experiment in which they end.
_MOST_DRAWN, _DRAWN_WITHIN = 7, 0.2
# Most changes drawn for one that can be made.
_IN_VAIN = 50

NEW = -1
"""Origin of a step that was not there."""


@dataclass(frozen=True)
class Train:
    """Steps that are held one after the other."""

    units: IntArray
    """Duration of each in shortest steps, (n_steps,)."""
    levels: Array
    """Torque of each in shares of the largest, (n_steps,)."""

    def waveform(self, limits: Limits) -> Waveform:
        """Return the torque against time."""
        return hold(self.units.astype(float) * limits.shortest_s, self.levels)


@dataclass(frozen=True)
class Neighbour:
    """A train that was made from another one."""

    train: Train
    """The changed train."""
    origins: IntArray
    """Index of each step in the other train, or `NEW`, (n_steps,)."""


def train_of(waveform: Waveform, limits: Limits) -> Train:
    """Return the train of a waveform that is held from step to step."""
    units = np.rint(waveform.durations_s / limits.shortest_s).astype(np.intp)
    return Train(units, waveform.levels / waveform.highest)


def random_train(limits: Limits, rng: np.random.Generator) -> Train:
    """Draw few steps, of times even in the logarithm, and a hold until the end."""
    whole = round(limits.longest_s / limits.shortest_s)
    count = int(rng.integers(2, 1 + min(_MOST_DRAWN, limits.most_steps, whole)))
    longest = np.log(max(1.0, _DRAWN_WITHIN * whole / (count - 1)))
    units = np.rint(np.exp(rng.random(count - 1) * longest)).astype(np.intp)
    levels = rng.random(count)
    return Train(np.append(units, whole - units.sum()), levels / levels.max())


def neighbour(train: Train, limits: Limits, rng: np.random.Generator) -> Neighbour | None:
    """Change a train at one place, or as a whole, by an amount that is drawn, too.

    Returns nothing where the change that was drawn cannot be made.
    """
    size = _LARGEST * _SMALLER ** rng.random()
    change = rng.choice(np.array(_CHANGES, dtype=object), p=_OFTEN)
    found: Neighbour | None = change(train, size, rng)
    if found is None or len(found.origins) > limits.most_steps or not found.train.levels.any():
        return None
    return found


def drawn_neighbour(train: Train, limits: Limits, rng: np.random.Generator) -> Neighbour | None:
    """Draw changes until one can be made; return nothing where none is found."""
    for _ in range(_IN_VAIN):
        if (other := neighbour(train, limits, rng)) is not None:
            return other
    return None


def without(train: Train, step: int, longer: int) -> Neighbour:
    """Leave out a step, while another one next to it lasts longer."""
    units = train.units.copy()
    units[longer] += units[step]
    kept = np.delete(np.arange(len(units)), step)
    return Neighbour(Train(units[kept], train.levels[kept]), kept)


def _change_level(train: Train, size: float, rng: np.random.Generator) -> Neighbour:
    levels, step = train.levels.copy(), rng.integers(len(train.levels))
    share, value = rng.random(), levels[step]
    if share < 0.1:
        levels[step] = rng.random()
    elif share < 0.2:
        levels[step] = 1.0
    elif share < 0.7:
        levels[step] = value * np.exp(size * rng.normal())
    else:
        levels[step] = value + size * rng.normal()
    return _same(train, train.units, np.clip(levels, 0.0, 1.0))


def _change_all_levels(train: Train, size: float, rng: np.random.Generator) -> Neighbour:
    along = np.linspace(-1.0, 1.0, len(train.levels))
    levels = train.levels * np.exp(size * rng.normal() * along)
    return _same(train, train.units, np.clip(levels, 0.0, 1.0))


def _move_edge(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    if len(train.units) < 2:
        return None
    units, step = train.units.copy(), rng.integers(len(train.units) - 1)
    both = units[step] + units[step + 1]
    units[step] = np.clip(_changed(units[step], size, rng), 1, both - 1)
    units[step + 1] = both - units[step]
    return _same(train, units, train.levels)


def _shift_later(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    if len(train.units) < 2:
        return None
    units, step = train.units.copy(), rng.integers(len(train.units) - 1)
    units[step] = max(1, _changed(units[step], size, rng))
    units[-1] -= units.sum() - train.units.sum()
    return _same(train, units, train.levels) if units[-1] >= 1 else None


def _stretch(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    units = np.rint(train.units[:-1] * np.exp(size * rng.normal())).astype(np.intp)
    units = np.append(np.maximum(units, 1), 0)
    units[-1] = train.units.sum() - units.sum()
    return _same(train, units, train.levels) if units[-1] >= 1 else None


def _split(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    """Divide a step in two, of which one gets another level."""
    step = int(rng.integers(len(train.units)))
    whole = int(train.units[step])
    if whole < 2:
        return None
    first = min(_drawn(whole, rng), whole - 1)
    if rng.random() < 0.3:
        first = whole - first
    changed = int(rng.integers(2))
    level = train.levels[step]
    new = level + size * rng.normal() if rng.random() < 0.5 else rng.random()
    levels = [level, level]
    levels[changed] = min(max(new, 0.0), 1.0)
    origins = [step, step]
    origins[changed] = NEW
    return _replaced(train, step, [first, whole - first], levels, origins)


def _insert(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    """Interrupt a step by a short one."""
    step = int(rng.integers(len(train.units)))
    whole = int(train.units[step])
    if whole < 3:
        return None
    first = min(_drawn(whole, rng), whole - 2)
    second = min(_drawn(whole - first, rng), whole - first - 1)
    level = train.levels[step]
    times = [first, second, whole - first - second]
    return _replaced(train, step, times, [level, rng.random(), level], [step, NEW, NEW])


def _leave_out(train: Train, size: float, rng: np.random.Generator) -> Neighbour | None:
    count = len(train.units)
    if count < 2:
        return None
    step = int(rng.integers(count))
    before = step == count - 1 or (step > 0 and rng.random() < 0.5)
    return without(train, step, step - 1 if before else step + 1)


def _same(train: Train, units: IntArray, levels: Array) -> Neighbour:
    return Neighbour(Train(units, levels), np.arange(len(units)))


def _replaced(
    train: Train, step: int, units: list[int], levels: list[float], origins: list[int]
) -> Neighbour:
    """Put several steps in the place of one."""

    def put(old: Array | IntArray, new: Sequence[float]) -> Array:
        return np.concatenate((old[:step], new, old[step + 1 :]))

    indices = np.arange(len(train.units))
    return Neighbour(
        Train(put(train.units, units).astype(np.intp), put(train.levels, levels)),
        put(indices, origins).astype(np.intp),
    )


def _changed(units: int, size: float, rng: np.random.Generator) -> int:
    return round(float(units * np.exp(2 * size * rng.normal()))) + int(rng.integers(-1, 2))


def _drawn(most: int, rng: np.random.Generator) -> int:
    """Draw a time up to a longest one, evenly in the logarithm."""
    return round(float(np.exp(rng.random() * np.log(most))))


_Change = Callable[[Train, float, np.random.Generator], Neighbour | None]
_CHANGES: tuple[_Change, ...] = (
    *(_change_level, _change_all_levels, _move_edge, _shift_later, _stretch),
    *(_split, _insert, _leave_out),
)
_OFTEN = (0.34, 0.03, 0.17, 0.14, 0.03, 0.14, 0.08, 0.07)
