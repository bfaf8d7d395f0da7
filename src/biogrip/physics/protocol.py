"""Protocol of the experiment: what is controlled against time, and sampling times.

Within a phase it is a quadratic in time, which covers holds and ramps given as torque, load or
deformation or, since a torque goes with the square of the voltage, as voltage. A gripper's torque
closes both arms alike; it is an increment on that which closes them onto the sample.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array

# Share of the largest level that a step is more than.
_LEAST_STEP = 1e-13


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


@dataclass(frozen=True)
class Course:
    """A protocol as a list of changes, to which linear responses superpose."""

    time_s: Array
    """Starts of the phases, (n_phases,)."""
    changes: Array
    """Jumps of level, slope and curvature at these times, (n_phases, 3)."""
    end_s: float
    """End of the protocol."""
    deforms: bool = False
    """True if a deformation is controlled, and the load is read: relaxation."""

    @cached_property
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
        return np.unique([start for start, *_ in self.jumps])

    @cached_property
    def within_phases(self) -> Array:
        """Level, slope and curvature at the starts of phases, (n_phases, 3)."""
        powers = self.changes.copy()
        for k, gap in enumerate(np.diff(self.time_s)):
            level, slope, curvature = powers[k]
            carried = level + slope * gap + curvature * gap**2 / 2, slope + curvature * gap
            powers[k + 1] += (*carried, curvature)
        return powers

    def times(self, factor: float) -> "Course":
        """Return the protocol with all that is controlled multiplied by a factor."""
        return replace(self, changes=factor * self.changes)

    @cached_property
    def only_steps(self) -> bool:
        """True if what is controlled is piecewise constant."""
        return not np.any(self.changes[:, 1:])


def hold(duration_s: float, level: float) -> Phase:
    """Return a phase that holds what the instrument controls at a level, in SI units.

    A gripper's level is the torque of both arms; in creep it is a stress or force, in relaxation a
    strain or displacement.
    """
    return Phase(duration_s, level)


def ramp(duration_s: float, level: float, to_level: float) -> Phase:
    """Return a phase in which what is controlled changes linearly from a level to another."""
    return Phase(duration_s, level, (to_level - level) / duration_s)


def join_phases(phases: tuple[Phase, ...], *, deforms: bool = False) -> Course:
    """Convert phases that follow one another from t = 0 into a list of changes.

    They are of a torque or load or, if the protocol `deforms`, of a deformation.
    """
    durations = np.array([phase.duration_s for phase in phases])
    ends = np.cumsum(durations)
    starts = np.concatenate(([0.0], ends[:-1]))
    # Level, slope and curvature at the start of each phase, and at its end.
    changes = np.array([[phase.level, phase.slope, phase.curvature] for phase in phases])
    level, slope, curvature = changes.T
    reached = (
        level + slope * durations + curvature * durations**2 / 2,
        slope + curvature * durations,
        curvature,
    )
    least = _LEAST_STEP * np.max(np.abs(level))
    changes[1:] -= np.stack(reached, axis=1)[:-1]
    # A ramp that ends where the next one begins makes no step, but for rounding.
    steps = changes[1:, 0]
    steps[np.abs(steps) < least] = 0.0
    return Course(starts, changes, float(ends[-1]), deforms)


def evaluate(course: Course, time_s: ArrayLike) -> Array:
    """Return what is controlled, (n_times,); at the instant of a step, its value after the step."""
    t = np.asarray(time_s, dtype=float)
    controlled = np.zeros_like(t)
    for start, (level, slope, curvature) in zip(course.time_s, course.changes, strict=True):
        elapsed = t - start
        gain = level + slope * elapsed + curvature * elapsed**2 / 2
        controlled += np.where(elapsed >= 0, gain, 0.0)
    return controlled


def is_held(course: Course, time_s: ArrayLike) -> bool:
    """Return True if what is controlled is the same at all of some times."""
    return bool(np.ptp(evaluate(course, time_s)) == 0)


def largest_load(phases: Iterable[Phase]) -> float:
    """Return what phases control of the largest magnitude.

    Within a phase nothing turns round.
    """
    ends = (level for phase in phases for level in phase.at([0.0, phase.duration_s]).tolist())
    return max(ends, key=abs)


def sample_times(duration_s: float, rate_Hz: float) -> Array:
    """Return uniform sampling times in s from 0, including the end if it falls on one."""
    count = int(np.floor(duration_s * rate_Hz * (1 + 1e-12))) + 1
    return np.arange(count) / rate_Hz
