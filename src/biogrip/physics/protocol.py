"""Protocol of the experiment: torque of both arms against time, and sampling times.

Within a phase a torque is a quadratic in time plus sinusoids, which covers holds, ramps and
sinusoids given as torque or, since torque goes with the square of the voltage, as voltage.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from biogrip.arrays import Array, ComplexArray
from biogrip.keys import Block

# Share of the largest load that a step is more than.
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Harmonic:
    """A sinusoid amplitude_Nm * cos(omega t + phase), t from the start of its phase."""

    amplitude_Nm: float
    omega_rad_per_s: float
    phase_rad: float


@dataclass(frozen=True)
class Load:
    """Closing torque of one arm within a phase, as a function of the time since its start."""

    value_Nm: float
    """Value of the quadratic value + slope t + curvature t^2 / 2."""
    slope_Nm_per_s: float = 0.0
    """Its slope."""
    curvature_Nm_per_s2: float = 0.0
    """Its curvature."""
    harmonics: tuple[Harmonic, ...] = ()
    """Sinusoids on top of it."""

    @property
    def powers(self) -> tuple[float, float, float]:
        """Value, slope and curvature."""
        return self.value_Nm, self.slope_Nm_per_s, self.curvature_Nm_per_s2

    def at(self, elapsed: ArrayLike) -> Array:
        """Return the torque in N m at times in s after the start of the phase."""
        t = np.asarray(elapsed, dtype=float)
        torque = self.value_Nm + self.slope_Nm_per_s * t + self.curvature_Nm_per_s2 * t**2 / 2
        for h in self.harmonics:
            torque = torque + h.amplitude_Nm * np.cos(h.omega_rad_per_s * t + h.phase_rad)
        return torque

    def divided(self, by: float) -> "Load":
        """Return the load divided by a number."""
        return Load(
            self.value_Nm / by,
            self.slope_Nm_per_s / by,
            self.curvature_Nm_per_s2 / by,
            tuple(replace(h, amplitude_Nm=h.amplitude_Nm / by) for h in self.harmonics),
        )

    def squared(self, kappa: float) -> "Load":
        """Return kappa times the square of a load V + r t or V + A sin(omega t).

        The squared sinusoid is V^2 + A^2/2 + 2 V A sin(omega t) - A^2/2 cos(2 omega t).
        """
        value, mean = self.value_Nm, self.value_Nm**2
        harmonics: list[Harmonic] = []
        for h in self.harmonics:
            a, omega = h.amplitude_Nm, h.omega_rad_per_s
            mean += a**2 / 2
            harmonics.append(Harmonic(2 * kappa * value * a, omega, h.phase_rad))
            harmonics.append(Harmonic(kappa * a**2 / 2, 2 * omega, math.pi))
        return Load(
            kappa * mean,
            2 * kappa * value * self.slope_Nm_per_s,
            2 * kappa * self.slope_Nm_per_s**2,
            tuple(harmonics),
        )


@dataclass(frozen=True)
class Phase:
    """A stretch of the protocol."""

    duration_s: float
    left: Load
    """Closing torque tau_2, as an increment on that which closes the arm onto the sample."""
    right: Load
    """Closing torque tau_4, likewise."""


Courses: TypeAlias = tuple[Array, list[list[tuple[float, ComplexArray]]]]
"""Value, slope and curvature at the start of each phase, (n_phases, n_drives, 3), and sinusoids of
each phase, as angular frequency and amplitudes, (n_drives,)."""


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
    harmonic_time_s: Array
    """Starts of sinusoids Re(a e^(i omega (t - start))), (n_harmonics,); each is followed by one of
    opposite sign, which switches it off."""
    omega_rad_per_s: Array
    """Their angular frequencies, (n_harmonics,)."""
    harmonic_left: ComplexArray
    """Their complex amplitudes a of tau_2 in N m, (n_harmonics,)."""
    harmonic_right: ComplexArray
    """Those of tau_4, (n_harmonics,)."""
    end_s: float
    """End of the protocol."""
    deforms: bool = False
    """True if a deformation is controlled, and the load is read: relaxation. `left` and
    `right` are then equal, and so are units of deformation everywhere."""

    @cached_property
    def symmetric(self) -> bool:
        """True if both arms are driven alike."""
        same = np.array_equal(self.left, self.right)
        return bool(same and np.array_equal(self.harmonic_left, self.harmonic_right))

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
    def swings(self) -> list[tuple[float, float, ComplexArray]]:
        """Sinusoids that start: time, angular frequency, complex amplitude of each drive."""
        amplitudes = drives(self.harmonic_left, self.harmonic_right, self.symmetric)
        rows = zip(self.harmonic_time_s, self.omega_rad_per_s, amplitudes.T, strict=True)
        return [(float(start), float(omega), a) for start, omega, a in rows]

    @cached_property
    def within_phases(self) -> Courses:
        """Course of each drive within phases."""
        return self._courses(lambda left, right: drives(left, right, self.symmetric))

    @cached_property
    def of_arms(self) -> Courses:
        """Course of the torque of each arm within phases."""
        return self._courses(lambda left, right: np.stack((left, right)))

    def _courses(self, combine: Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]) -> Courses:
        powers = np.moveaxis(combine(self.left, self.right), 1, 0).copy()
        for k, gap in enumerate(np.diff(self.time_s)):
            value, slope, curvature = powers[k].T
            carried = (value + slope * gap + curvature * gap**2 / 2, slope + curvature * gap)
            powers[k + 1] += np.stack((*carried, curvature), axis=1)
        harmonics: list[list[tuple[float, ComplexArray]]] = [[] for _ in self.time_s]
        amplitudes = combine(self.harmonic_left, self.harmonic_right).T
        # Each is followed by the one that switches it off.
        starts = zip(self.harmonic_time_s, self.omega_rad_per_s, amplitudes, strict=True)
        for start, omega, a in list(starts)[::2]:
            harmonics[self.time_s.searchsorted(start)].append((float(omega), a))
        return powers, harmonics

    def times(self, factor: float) -> "TorqueHistory":
        """Return the protocol with all torques multiplied by a factor."""
        names = ("left", "right", "harmonic_left", "harmonic_right")
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    @cached_property
    def only_steps(self) -> bool:
        """True if the torque is piecewise constant."""
        ramps = np.any(self.left[:, 1:]) or np.any(self.right[:, 1:])
        return not ramps and len(self.harmonic_time_s) == 0


def hold(duration_s: float, level: float, right: float | None = None) -> Phase:
    """Return a phase that holds what the instrument controls at a level, in SI units.

    A gripper's level is the torque of both arms, or of the left one if there is a `right`; in creep
    it is a stress or force, in relaxation a strain or displacement.
    """
    return Phase(duration_s, Load(level), Load(level if right is None else right))


def load(
    duration_s: float,
    torque_Nm: float,
    to_torque_Nm: float | None = None,
    amplitude_Nm: float | None = None,
    frequency_Hz: float | None = None,
) -> Load:
    """Return a torque that is held, changes linearly, or has a sinusoid on top.

    Parameters
    ----------
    duration_s, torque_Nm
        Duration of the phase, and torque at its start.
    to_torque_Nm
        Torque at its end, if it changes linearly.
    amplitude_Nm, frequency_Hz
        Those of a sinusoid that starts at its mean, rising.
    """
    slope = ((torque_Nm if to_torque_Nm is None else to_torque_Nm) - torque_Nm) / duration_s
    harmonics: tuple[Harmonic, ...] = ()
    if amplitude_Nm is not None and frequency_Hz is not None:
        harmonics = (Harmonic(amplitude_Nm, 2 * math.pi * frequency_Hz, -math.pi / 2),)
    return Load(torque_Nm, slope, 0.0, harmonics)


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
    events = [
        event
        for start, phase in zip(starts, phases, strict=True)
        for event in _harmonic_events(start, phase)
    ]
    times, omegas = np.array([event[:2] for event in events]).reshape(-1, 2).T
    left, right = np.array([a for *_, a in events], complex).reshape(-1, 2).T
    return TorqueHistory(
        starts, jumps[:, 0], jumps[:, 1], times, omegas, left, right, float(ends[-1]), deforms
    )


def _harmonic_events(start: float, phase: Phase) -> Iterator[tuple[float, float, ComplexArray]]:
    """Yield the events that switch the sinusoids of a phase on, and at its end off.

    Those of both arms that have the same frequency are one.
    """
    amplitudes: dict[float, ComplexArray] = {}
    for arm, load in enumerate((phase.left, phase.right)):
        for h in load.harmonics:
            both = amplitudes.setdefault(h.omega_rad_per_s, np.zeros(2, complex))
            both[arm] += h.amplitude_Nm * np.exp(1j * h.phase_rad)
    for omega, both in amplitudes.items():
        yield start, omega, both
        yield start + phase.duration_s, omega, -both * np.exp(1j * omega * phase.duration_s)


def torque_at(history: TorqueHistory, time_s: ArrayLike, arm: str = "left") -> Array:
    """Return the torque of an arm in N m; at the instant of a step, its value after the step."""
    t = np.asarray(time_s, dtype=float)
    torque = np.zeros_like(t)
    for start, (value, slope, curvature) in zip(history.time_s, getattr(history, arm), strict=True):
        elapsed = t - start
        gain = value + slope * elapsed + curvature * elapsed**2 / 2
        torque += np.where(elapsed >= 0, gain, 0.0)
    amplitudes = getattr(history, f"harmonic_{arm}")
    for start, omega, a in zip(
        history.harmonic_time_s, history.omega_rad_per_s, amplitudes, strict=True
    ):
        elapsed = t - start
        torque += np.where(elapsed >= 0, (a * np.exp(1j * omega * elapsed)).real, 0.0)
    return torque


def is_held(history: TorqueHistory, time_s: ArrayLike) -> bool:
    """Return True if the torque of either arm is the same at all of some times."""
    return all(np.ptp(torque_at(history, time_s, arm)) == 0 for arm in ("left", "right"))


def largest_load(phases: Iterable[Phase]) -> float:
    """Return the torque of either arm, or of what else they control, of the largest magnitude.

    Within a phase nothing but a sinusoid turns round, which counts with its whole amplitude.
    """
    found: list[float] = []
    for phase in phases:
        for own in (phase.left, phase.right):
            swing = sum(abs(harmonic.amplitude_Nm) for harmonic in own.harmonics)
            ends = replace(own, harmonics=()).at([0.0, phase.duration_s])
            found += [*(ends + swing).tolist(), *(ends - swing).tolist()]
    return max(found, key=abs)


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
