"""Protocol of the experiment: torque of both arms against time, and sampling times.

Within a phase a torque is a quadratic in time, which covers holds and ramps given as torque or,
since torque goes with the square of the voltage, as voltage.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block

# Share of the largest load that a step is more than.
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Load:
    """Closing torque of one arm, value + slope t + curvature t^2 / 2 from a phase's start on."""

    value_Nm: float
    slope_Nm_per_s: float = 0.0
    curvature_Nm_per_s2: float = 0.0

    @property
    def powers(self) -> tuple[float, float, float]:
        """Value, slope and curvature."""
        return self.value_Nm, self.slope_Nm_per_s, self.curvature_Nm_per_s2

    def at(self, elapsed: ArrayLike) -> Array:
        """Return the torque in N m at times in s after the start of the phase."""
        t = np.asarray(elapsed, dtype=float)
        value, slope, curvature = self.powers
        return value + slope * t + curvature * t**2 / 2

    def divided(self, by: float) -> "Load":
        """Return the load divided by a number."""
        return Load(*(power / by for power in self.powers))

    def squared(self, kappa: float) -> "Load":
        """Return kappa times the square of a load V + r t."""
        value, slope, _ = self.powers
        return Load(kappa * value**2, 2 * kappa * value * slope, 2 * kappa * slope**2)


@dataclass(frozen=True)
class Phase:
    """A stretch of the protocol."""

    duration_s: float
    left: Load
    """Closing torque tau_2, as an increment on that which closes the arm onto the sample."""
    right: Load
    """Closing torque tau_4, likewise."""


@dataclass(frozen=True)
class TorqueHistory:
    """A protocol as a list of torque changes, to which linear responses superpose."""

    time_s: Array
    """Starts of the phases, (n_events,)."""
    left: Array
    """Jumps of value (N m), slope (N m/s) and curvature (N m/s^2) of tau_2 at these times,
    (n_events, 3)."""
    right: Array
    """Those of tau_4, (n_events, 3)."""
    end_s: float
    """End of the protocol."""
    deforms: bool = False
    """True if a deformation is controlled, and the load is read: relaxation. `left` and
    `right` are then equal, and so are units of deformation everywhere."""

    @cached_property
    def symmetric(self) -> bool:
        """True if both arms are driven alike."""
        return np.array_equal(self.left, self.right)

    @cached_property
    def jumps(self) -> list[tuple[float, int, Array]]:
        """Torque changes proportional to t^order/order!: start, order, height of each drive."""
        heights = drives(self.left, self.right, self.symmetric)
        return [
            (float(start), order, heights[:, event, order])
            for event, start in enumerate(self.time_s)
            for order in range(heights.shape[2])
            if np.any(heights[:, event, order])
        ]

    @cached_property
    def changes_s(self) -> Array:
        """Times at which the torque changes, ascending."""
        return np.unique([start for start, *_ in self.jumps])

    @cached_property
    def within_phases(self) -> Array:
        """Value, slope, curvature of each drive at starts of phases, (n_phases, n_drives, 3)."""
        return self._courses(drives(self.left, self.right, self.symmetric))

    @cached_property
    def of_arms(self) -> Array:
        """Those of the torque of each arm, (n_phases, 2, 3)."""
        return self._courses(np.stack((self.left, self.right)))

    def _courses(self, jumps: Array) -> Array:
        powers = np.moveaxis(jumps, 1, 0).copy()
        for k, gap in enumerate(np.diff(self.time_s)):
            value, slope, curvature = powers[k].T
            carried = (value + slope * gap + curvature * gap**2 / 2, slope + curvature * gap)
            powers[k + 1] += np.stack((*carried, curvature), axis=1)
        return powers

    def times(self, factor: float) -> "TorqueHistory":
        """Return the protocol with all torques multiplied by a factor."""
        return replace(self, left=factor * self.left, right=factor * self.right)

    @cached_property
    def only_steps(self) -> bool:
        """True if the torque is piecewise constant."""
        return not (np.any(self.left[:, 1:]) or np.any(self.right[:, 1:]))


def hold(duration_s: float, level: float, right: float | None = None) -> Phase:
    """Return a phase that holds what the instrument controls at a level, in SI units.

    A gripper's level is the torque of both arms, or of the left one if there is a `right`; in creep
    it is a stress or force, in relaxation a strain or displacement.
    """
    return Phase(duration_s, Load(level), Load(level if right is None else right))


def load(duration_s: float, torque_Nm: float, to_torque_Nm: float | None = None) -> Load:
    """Return a torque that is held in a phase, or changes linearly to that at its end."""
    slope = ((torque_Nm if to_torque_Nm is None else to_torque_Nm) - torque_Nm) / duration_s
    return Load(torque_Nm, slope)


def drives(left: NDArray[Any], right: NDArray[Any], symmetric: bool) -> NDArray[Any]:
    """Combine torques, or jumps, of both arms, (...), into the drives of `step_response`.

    One drive, the common one, if both arms are driven alike; else that of the left arm, and left
    minus right: (n_drives, ...).
    """
    return left[None] if symmetric else np.stack((left, left - right))


def torque_history(phases: tuple[Phase, ...], *, deforms: bool = False) -> TorqueHistory:
    """Convert phases that follow one another from t = 0 into a list of changes.

    They are of a torque or, if the protocol `deforms`, of a deformation.
    """
    durations = np.array([phase.duration_s for phase in phases])
    ends = np.cumsum(durations)
    starts = np.concatenate(([0.0], ends[:-1]))
    # Value, slope and curvature of each arm at the start of each phase, and at its end.
    jumps = np.array([[load.powers for load in (phase.left, phase.right)] for phase in phases])
    value, slope, curvature = np.moveaxis(jumps, 2, 0)
    t = durations[:, None]
    reached = value + slope * t + curvature * t**2 / 2, slope + curvature * t, curvature
    least = _ROUNDING * np.max(np.abs(value))
    jumps[1:] -= np.stack(reached, axis=2)[:-1]
    # A ramp that ends where the next one begins makes no step, but for rounding.
    steps = jumps[1:, :, 0]
    steps[np.abs(steps) < least] = 0.0
    return TorqueHistory(starts, jumps[:, 0], jumps[:, 1], float(ends[-1]), deforms)


def torque_at(history: TorqueHistory, time_s: ArrayLike, arm: str = "left") -> Array:
    """Return the torque of an arm in N m; at the instant of a step, its value after the step."""
    t = np.asarray(time_s, dtype=float)
    torque = np.zeros_like(t)
    for start, (value, slope, curvature) in zip(history.time_s, getattr(history, arm), strict=True):
        elapsed = t - start
        gain = value + slope * elapsed + curvature * elapsed**2 / 2
        torque += np.where(elapsed >= 0, gain, 0.0)
    return torque


def is_held(history: TorqueHistory, time_s: ArrayLike) -> bool:
    """Return True if the torque of either arm is the same at all of some times."""
    return all(np.ptp(torque_at(history, time_s, arm)) == 0 for arm in ("left", "right"))


def largest_load(phases: Iterable[Phase]) -> float:
    """Return the torque of either arm, or of what else they control, of the largest magnitude.

    Within a phase nothing turns round.
    """
    ends = (own.at([0.0, p.duration_s]).tolist() for p in phases for own in (p.left, p.right))
    return max((value for pair in ends for value in pair), key=abs)


def sample_times(duration_s: float, rate_Hz: float) -> Array:
    """Return uniform sampling times in s from 0, including the end if it falls on one."""
    count = int(np.floor(duration_s * rate_Hz * (1 + 1e-12))) + 1
    return np.arange(count) / rate_Hz


@dataclass(frozen=True)
class Burst(Block):
    """Successive readings at a rate of their own."""

    from_s: Annotated[float, Field(ge=0, le=1e9)]
    """Time of its first reading."""
    rate_Hz: Annotated[float, Field(ge=1e-9, le=1e9)]
    """Rate within the burst."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)]
    """Number of readings."""

    @property
    def times_s(self) -> Array:
        """Sampling times in s, (n_samples,)."""
        return self.from_s + np.arange(self.samples) / self.rate_Hz


@dataclass(frozen=True)
class Sampling:
    """Sampling of the rotation: a uniform rate or bursts."""

    rate_Hz: float = 0.0
    """Uniform rate, from 0 to the end of the protocol."""
    bursts: tuple[Burst, ...] = ()
    """Bursts, instead of a rate."""

    def over(self, end_s: float) -> Array:
        """Return the sampling times in s, (n_samples,), of a protocol that ends at `end_s`."""
        if self.bursts:
            return np.concatenate([burst.times_s for burst in self.bursts])
        return sample_times(end_s, self.rate_Hz)
