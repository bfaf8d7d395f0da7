"""Readings that are averages, as over the exposure of a camera's frame.

The response of a linear system is linear in what drives it, and does not depend on when. So the
mean of its readings over an exposure is its reading under the mean of the torque over as long.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from math import pi, sin

from biogrip.experiment.protocol import Harmonic, Load, Phase

_NOTHING = Load(0.0)


def average(phases: Sequence[Phase], exposure_s: float) -> tuple[Phase, ...]:
    """Return phases that follow the mean of a torque over the exposure before each instant.

    Before the first phase nothing is held. A step becomes a ramp as long as the exposure.

    Parameters
    ----------
    phases
        Phases without curvature, for its mean is of third order.
    exposure_s
        Time over which each reading is averaged, up to its instant.

    Raises
    ------
    ValueError
        If a phase is curved.
    """
    if not exposure_s:
        return tuple(phases)
    if has_curvature(phases):
        raise ValueError("the mean of a curved torque is no phase")
    starts_s = [0.0, *accumulate(phase.duration_s for phase in phases)]
    arms = [
        _Drive([getattr(phase, name) for phase in phases], starts_s) for name in ("left", "right")
    ]
    end_s = starts_s[-1]
    # What is shorter than rounding is no phase.
    least_s = 1e-12 * end_s
    instants: list[float] = []
    for instant in sorted([*starts_s, *(start_s + exposure_s for start_s in starts_s)]):
        if instant < end_s - least_s and (not instants or instant > instants[-1] + least_s):
            instants.append(instant)
    return tuple(
        Phase(finish_s - begin_s, *(_mean(arm, begin_s, finish_s, exposure_s) for arm in arms))
        for begin_s, finish_s in pairwise([*instants, end_s])
    )


def has_curvature(phases: Sequence[Phase]) -> bool:
    """Return True if a torque is curved, as under a ramp of the voltage."""
    return any(own.curvature_Nm_per_s2 for each in phases for own in (each.left, each.right))


class _Drive:
    """Torque of an arm, and its integral."""

    def __init__(self, loads: Sequence[Load], starts_s: Sequence[float]) -> None:
        self._loads, self._starts_s = loads, starts_s
        whole = map(_integral, loads, (end - start for start, end in pairwise(starts_s)))
        self._totals = [0.0, *accumulate(whole)]

    def load(self, time_s: float, within_s: float) -> Load:
        """Return the load from some time on, of the phase that another time is in."""
        k = bisect_right(self._starts_s, within_s) - 1
        if k < 0:
            return _NOTHING
        load, elapsed_s = self._loads[k], time_s - self._starts_s[k]
        return Load(
            load.value_Nm + load.slope_Nm_per_s * elapsed_s,
            load.slope_Nm_per_s,
            harmonics=tuple(
                replace(h, phase_rad=h.phase_rad + h.omega_rad_per_s * elapsed_s)
                for h in load.harmonics
            ),
        )

    def integral(self, time_s: float) -> float:
        """Return the integral of the torque until some time."""
        k = min(bisect_right(self._starts_s, time_s), len(self._loads)) - 1
        if k < 0:
            return 0.0
        return self._totals[k] + _integral(self._loads[k], time_s - self._starts_s[k])


def _integral(load: Load, t: float) -> float:
    """Return the integral of a load from its start."""
    total = load.value_Nm * t + load.slope_Nm_per_s * t**2 / 2
    for h in load.harmonics:
        swung = sin(h.omega_rad_per_s * t + h.phase_rad) - sin(h.phase_rad)
        total += h.amplitude_Nm / h.omega_rad_per_s * swung
    return total


def _mean(drive: _Drive, begin_s: float, finish_s: float, exposure_s: float) -> Load:
    """Return the mean of a torque in a phase, in which nothing else enters the mean or leaves."""
    middle_s = (begin_s + finish_s) / 2
    entering = drive.load(begin_s, middle_s)
    leaving = drive.load(begin_s - exposure_s, middle_s - exposure_s)
    value = (drive.integral(begin_s) - drive.integral(begin_s - exposure_s)) / exposure_s
    harmonics = []
    for sign, load in ((1.0, entering), (-1.0, leaving)):
        for h in load.harmonics:
            amplitude = sign * h.amplitude_Nm / (h.omega_rad_per_s * exposure_s)
            harmonics.append(Harmonic(amplitude, h.omega_rad_per_s, h.phase_rad - pi / 2))
            value -= amplitude * sin(h.phase_rad)
    slope = (entering.value_Nm - leaving.value_Nm) / exposure_s
    curvature = (entering.slope_Nm_per_s - leaving.slope_Nm_per_s) / exposure_s
    return Load(value, slope, curvature, tuple(harmonics))
