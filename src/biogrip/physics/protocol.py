"""Protocol of the experiment: what is controlled against time, and sampling times.

Within a phase it is a quadratic in time, which covers holds and ramps given as torque, load or
deformation or, since a torque goes with the square of the voltage, as voltage. A gripper's torque
closes both arms alike; it is an increment on that which closes them onto the sample.

A recorded load or deformation is a piece from row to row, along all that was read (`follow_rows`):
the cubic that has the readings and the rates at both rows. The rate at a row is

- that of the side on which the rows go on in a line, as beside a step; if they do on both sides,
  each on its own, the rate jumps there;
- else that of the quartic through five rows, where these are smooth: of a sinusoid with 25 rows a
  period it is off by 1e-4, where the mean of the rates on both sides is off by 1e-2;
- the mean of both sides elsewhere, as in noise;
- at the second row it jumps if nothing changed up to there.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import factorial
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array, BoolArray

# Share of the largest level that a step is more than.
_LEAST_STEP = 1e-13
# Share of how far times are apart by which one may be off a change for rounding alone.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Phase:
    """A stretch of the protocol, level + slope t + curvature t^2 / 2 from its start on, in SI."""

    duration_s: float
    level: float
    slope: float = 0.0
    curvature: float = 0.0

    def at(self, elapsed_s: ArrayLike) -> Array:
        """Return what is controlled at times in s after the start of the phase."""
        t = np.asarray(elapsed_s, dtype=float)
        return self.level + self.slope * t + self.curvature * t**2 / 2

    def divided(self, by: float) -> "Phase":
        """Return the phase divided by a number."""
        return Phase(self.duration_s, self.level / by, self.slope / by, self.curvature / by)

    def squared(self, kappa: float) -> "Phase":
        """Return kappa times the square of a phase V + r t."""
        level, slope = self.level, self.slope
        return Phase(
            self.duration_s, kappa * level**2, 2 * kappa * level * slope, 2 * kappa * slope**2
        )


@dataclass(frozen=True, eq=False)
class Course:
    """A protocol as a list of changes, to which linear responses superpose.

    Orders are level, slope and curvature; of a recorded course, the rate of the curvature, too.
    """

    time_s: Array
    """Starts of the phases, (n_phases,)."""
    changes: Array
    """Jumps of all orders at these times, (n_phases, n_orders)."""
    within_phases: Array
    """All orders at the starts of the phases, (n_phases, n_orders)."""
    end_s: float
    """End of the protocol."""
    deforms: bool = False
    """True if a deformation is controlled, and the load is read: relaxation."""
    sweeps: ClassVar[bool] = False
    """True if it is a `Sweep`, whose readings do not follow one another in time."""

    @property
    def jumps(self) -> list[tuple[float, int, float]]:
        """Changes proportional to t^order/order!: start, order and height."""
        return [
            (float(start), order, height)
            for start, heights in zip(self.time_s, self.changes.tolist(), strict=True)
            for order, height in enumerate(heights)
            if height
        ]

    @cached_property
    def changes_s(self) -> Array:
        """Times at which what is controlled changes, ascending."""
        return np.unique(self.time_s[np.any(self.changes, axis=1)])

    @property
    def steps_s(self) -> Array:
        """Times of steps, ascending."""
        return self.time_s[self.changes[:, 0] != 0]

    @property
    def jumps_s(self) -> Array:
        """Times at which a sample may jump, ascending: those of steps.

        Of a deformation, they are also those at which its rate jumps, and with it a damper's force.
        """
        return self.time_s[np.any(self.changes[:, : 1 + self.deforms], axis=1)]

    def spread_s(self, time_s: Array) -> tuple[float, float]:
        """Return the shortest and the longest time that readings are apart."""
        return float(np.min(np.diff(time_s))), float(np.ptp(time_s))

    def covered_s(self, time_s: Array) -> tuple[float, float]:
        """Return from when to when after a change of what is controlled there are readings."""
        after = time_s[time_s > self.changes_s[0]]
        elapsed = after - self.changes_s[self.changes_s.searchsorted(after) - 1]
        return float(elapsed.min()), float(after[-1] - self.changes_s[0])

    def place(self, time_s: float) -> str:
        """Return in words where a reading is."""
        return f"{time_s:.6g} s"

    def times(self, factor: float) -> "Course":
        """Return the protocol with all that is controlled multiplied by a factor."""
        scaled = factor * self.changes, factor * self.within_phases
        return replace(self, changes=scaled[0], within_phases=scaled[1])

    def risen(self, within_s: float) -> "Course":
        """Return the protocol with all steps reached linearly within some s, from when they came.

        What comes after a step is superposed, as in linear responses.
        """
        at, heights = self.time_s, self.changes[:, 0]
        rates = np.zeros((2 * np.count_nonzero(heights), max(2, self.changes.shape[1])))
        rates[:, 1] = np.concatenate((heights[heights != 0], -heights[heights != 0])) / within_s
        rest = np.pad(self.changes, ((0, 0), (0, rates.shape[1] - self.changes.shape[1])))
        rest[:, 0] = 0.0
        starts = np.concatenate((at, at[heights != 0], at[heights != 0] + within_s))
        end_s = max(self.end_s, float(starts.max()))
        return superposed(starts, np.vstack((rest, rates)), end_s, deforms=self.deforms)

    def snapped(self, time_s: Array) -> Array:
        """Return ascending times, (n_times,), with those that are changes but for rounding on them.

        A time is moved to a change that is nearer than 1e-9 of how far it is from its neighbours.
        """
        if len(time_s) < 2 or not len(self.changes_s):
            return time_s
        gaps = np.diff(time_s)
        apart = np.minimum(np.append(gaps, gaps[-1]), np.append(gaps[0], gaps))
        after = np.clip(self.changes_s.searchsorted(time_s), 1, max(1, len(self.changes_s) - 1))
        near = self.changes_s[np.stack((after - 1, np.minimum(after, len(self.changes_s) - 1)))]
        nearest = np.where(np.abs(near[0] - time_s) <= np.abs(near[1] - time_s), *near)
        return np.where(np.abs(nearest - time_s) <= _ROUNDING * apart, nearest, time_s)


class Sweep(Course):
    """A frequency sweep, in which a sample is strained by sines, and moduli are over the strain.

    Both have one axis: the loss modulus stands at minus the angular frequency in rad/s, the storage
    modulus at plus it. A frequency w tells of times about 1/w.
    """

    sweeps = True

    def spread_s(self, time_s: Array) -> tuple[float, float]:
        """Return the inverse of the highest and of the lowest frequency."""
        omega = np.abs(time_s)
        return float(1 / omega.max()), float(1 / omega.min())

    covered_s = spread_s

    def place(self, time_s: float) -> str:
        """Return modulus and frequency in words."""
        return f"{abs(time_s):.4g} rad/s ({'storage' if is_storage(time_s) else 'loss'})"


SWEEP = Sweep(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), 1.0, deforms=True)
"""Any sweep."""


def is_storage(places: Array | float) -> BoolArray:
    """Return which places are of the storage modulus; the others are of the loss modulus."""
    return np.asarray(places) > 0


def joined(omega: Array, storage: Array, loss: Array) -> tuple[Array, Array]:
    """Return places and readings of a sweep, (2 n_omega,), from ascending frequencies in rad/s."""
    return np.append(-omega[::-1], omega), np.append(loss[::-1], storage)


def hold(duration_s: float, level: float) -> Phase:
    """Return a phase that holds what the instrument controls at a level, in SI units.

    Of a gripper it is the torque of both arms; in creep a stress or force, in relaxation a strain
    or displacement.
    """
    return Phase(duration_s, level)


def ramp(duration_s: float, level: float, to_level: float) -> Phase:
    """Return a phase in which what is controlled changes linearly from a level to another."""
    return Phase(duration_s, level, (to_level - level) / duration_s)


def join_phases(phases: tuple[Phase, ...], *, deforms: bool = False) -> Course:
    """Convert phases of a load or deformation, one after the other from 0, to changes."""
    durations = np.array([phase.duration_s for phase in phases])
    ends = np.cumsum(durations)
    starts = np.concatenate(([0.0], ends[:-1]))
    # Level, slope and curvature at the start of each phase, less those before it.
    changes = np.array([[phase.level, phase.slope, phase.curvature] for phase in phases])
    least = _LEAST_STEP * np.max(np.abs(changes), axis=0)
    changes[1:] -= np.stack(_carried(changes.T, durations), axis=1)[:-1]
    # A ramp that ends where the next one begins makes no step, but for rounding, and one that goes
    # on at the same rate no jump of the rate.
    changes[1:][np.abs(changes[1:]) < least] = 0.0
    return superposed(starts, changes, float(ends[-1]), deforms=deforms)


def superposed(starts_s: Array, changes: Array, end_s: float, *, deforms: bool) -> Course:
    """Return the protocol of changes of all orders, (n, n_orders), at times in any order, (n,)."""
    time_s, place = np.unique(starts_s, return_inverse=True)
    summed = np.zeros((len(time_s), changes.shape[1]))
    np.add.at(summed, place, changes)
    within = summed.copy()
    for k, gap in enumerate(np.diff(time_s)):
        within[k + 1] += _carried(within[k], gap)
    return Course(time_s, summed, within, end_s, deforms)


def _carried(orders: Array, t: Array | float) -> list[Array]:
    """Return level, slope, curvature and so on after a time."""
    return [
        sum((own * t**n / factorial(n) for n, own in enumerate(orders[order:])), np.zeros(()))
        for order in range(len(orders))
    ]


def evaluate(course: Course, time_s: ArrayLike) -> Array:
    """Return what is controlled, (n_times,); at the instant of a step, its value after the step."""
    t = np.asarray(time_s, dtype=float)
    phase = course.time_s.searchsorted(t, side="right") - 1
    powers, elapsed = course.within_phases[phase].T, t - course.time_s[phase]
    controlled = sum(each * elapsed**n / factorial(n) for n, each in enumerate(powers))
    return np.where(phase >= 0, controlled, 0.0)


def is_held(course: Course, time_s: ArrayLike) -> bool:
    """Return True if what is controlled is the same at all of some times."""
    return bool(np.ptp(evaluate(course, time_s)) == 0)


def largest_load(phases: Iterable[Phase]) -> float:
    """Return what phases, in which nothing turns round, control of the largest magnitude."""
    ends = (level for phase in phases for level in phase.at([0.0, phase.duration_s]).tolist())
    return max(ends, key=abs)


def spacing_at(time_s: Array, at_s: float) -> float:
    """Return how far ascending times, (n,), are apart at one of them, or nearest to it, in s."""
    after = int(np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1))
    return float(time_s[after] - time_s[after - 1])


def sample_times(duration_s: float, rate_Hz: float) -> Array:
    """Return uniform sampling times in s from 0, including the end if it falls on one."""
    count = int(np.floor(duration_s * rate_Hz * (1 + 1e-12))) + 1
    return np.arange(count) / rate_Hz


# Rows around one of which a quartic is known, and that many on either side.
_ROWS, _ASIDE = 5, 2
# Change of the second derivative from row to row, as a share of its size, in smooth rows; second
# derivative of rows in a line, as a share of that at the end of the line.
_SMOOTH, _STRAIGHT = 0.25, 0.1
# Change from row to row that is a step: over those of the rows around, and of the extent. Change
# that is noise, over its standard deviation.
_ABRUPT, _STEP_OF_EXTENT, _OF_NOISE = 8.0, 0.01, 4.0


def with_steps(record: Array, least: float = 0.0, noise_sd: float = 0.0) -> tuple[Array, Array]:
    """Return a record, (n, 2), with a step in the middle of each two rows between which one came.

    A step is two rows of one time, not smaller than the least, and not of the sensor's noise. Also
    returned are standard deviations of their times in s, (n_steps,), which are anywhere between
    the rows.
    """
    time_s, values = record.T
    sizes = np.pad(np.abs(np.diff(values)), _ASIDE)
    around = [np.roll(sizes, by) for by in (-2, -1, 1, 2)]
    least = max(least, _STEP_OF_EXTENT * float(np.ptp(values)))
    usual = np.maximum(np.max(around, axis=0) - _OF_NOISE * noise_sd, noise_sd)
    abrupt = sizes > np.maximum(_ABRUPT * usual, least)
    before = np.flatnonzero(abrupt[_ASIDE:-_ASIDE])
    middle_s = 0.5 * (time_s[before] + time_s[before + 1])
    steps = np.stack((np.repeat(middle_s, 2), np.ravel(values[before[:, None] + [0, 1]])), axis=1)
    lasts_s = time_s[before + 1] - time_s[before]
    return np.insert(record, np.repeat(before + 1, 2), steps, axis=0), lasts_s / np.sqrt(12)


def follow_rows(time_s: Array, values: Array, *, deforms: bool) -> Course:
    """Return the protocol that goes through all rows of a record, from the first on.

    Times from its start, (n,), ascend, at least two; two rows of one time are a step. What was
    controlled, (n,), jumps there from zero at the first row; it may be what `deforms`. Where
    nothing changes, rows make no phases of their own.
    """
    # Without its steps the course goes on from row to row.
    at_once = np.diff(time_s, append=np.inf) == 0
    heights = np.where(at_once, np.diff(values, append=0.0), 0.0)
    first = ~np.append(False, at_once[:-1])
    levels = np.cumsum(heights)
    values, time_s = (values - levels + heights)[first], time_s[first]
    heights, levels = heights[first], levels[first]
    left, right = _rates(time_s, values)
    length, chord = np.diff(time_s), np.diff(values) / np.diff(time_s)
    # What the rates at both ends of a piece exceed that of a line by.
    first, last = right[:-1] - chord, left[1:] - chord
    powers = np.stack(
        (
            values[:-1],
            right[:-1],
            -2 * (2 * first + last) / length,
            6 * (first + last) / length**2,
        ),
        axis=1,
    )
    changes = powers.copy()
    powers[:, 0] += levels[:-1]
    changes[1:, 0] = heights[1:-1]
    changes[1:, 1] -= left[1:-1]
    changes[1:, 2] -= powers[:-1, 2] + powers[:-1, 3] * length[:-1]
    changes[1:, 3] -= powers[:-1, 3]
    changing = np.any(changes, axis=1)
    changing[0] = True
    return Course(time_s[:-1][changing], changes[changing], powers[changing], time_s[-1], deforms)


def _rates(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the rates before and after each row, which differ where the rate jumps, (n,) each."""
    chords = np.diff(values) / np.diff(time_s)
    before, after = np.append(chords[:1], chords), np.append(chords, chords[-1:])
    if len(values) < _ROWS:
        return before, after
    bends = np.pad(2 * np.diff(chords) / (time_s[2:] - time_s[:-2]), 1 + _ASIDE, mode="edge")
    sizes = np.abs(bends)
    at_end = _STRAIGHT * sizes[_ASIDE:-_ASIDE]
    straight_before = np.maximum(sizes[:-4], sizes[1:-3]) <= at_end
    straight_after = np.maximum(sizes[3:-1], sizes[4:]) <= at_end
    quartic, smooth = _quartics(time_s, values, bends[_ASIDE:-_ASIDE])
    rates = np.where(smooth, quartic, 0.5 * (before + after))
    lines = [(straight_before, before), (straight_after, after)]
    left, right = (
        np.select([one[0], other[0]], [one[1], other[1]], rates)
        for one, other in (lines, lines[::-1])
    )
    if chords[0] == 0:
        # It was not recorded, or has just begun to change.
        left[1], right[1] = 0.0, chords[1]
    return left, right


def _quartics(time_s: Array, values: Array, bends: Array) -> tuple[Array, BoolArray]:
    """Return rates at rows, (n,), of quartics through the nearest five; and which are smooth."""
    count = len(values)
    rows = np.clip(np.arange(count) - _ASIDE, 0, count - _ROWS)[:, None] + np.arange(_ROWS)
    inner = bends[rows[:, 1:-1]].T
    uneven = np.abs(inner[0] - 2 * inner[1] + inner[2])
    smooth: BoolArray = uneven <= _SMOOTH * np.sum(np.abs(inner), axis=0)
    others = rows[rows != np.arange(count)[:, None]].reshape(count, -1)
    # Derivatives of Lagrange's polynomials at the row itself, whose own is minus their sum.
    away, rates = (time_s[others] - time_s[:, None]).T, np.zeros(count)
    for row, (own, reading) in enumerate(zip(away, values[others].T, strict=True)):
        rest = np.delete(away, row, axis=0)
        rates += np.prod(rest / (rest - own), axis=0) / own * (reading - values)
    return rates, smooth
