"""Torques as they can be set: few digits, and whole slots of the camera."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.experiment import Wanted
from biogrip.design.search import Torque
from biogrip.experiment.protocol import Phase, load

_DIGITS = 4


@dataclass(frozen=True)
class Setting:
    """A torque that can be set.

    Parameters
    ----------
    phases
        Torques of both arms.
    slots : (n_steps,)
        How many readings each has room for at the fastest.
    periods : (n_steps,)
        How many a period has; none where nothing swings.
    """

    phases: tuple[Phase, ...]
    slots: IntArray
    periods: IntArray


def set_values(wanted: Wanted, torque: Torque) -> Setting:
    """Round a torque to what can be set; none becomes larger.

    Parameters
    ----------
    wanted
        What is designed, and how fast is read.
    torque
        To be rounded.
    """
    waveform, rate = torque.waveform, wanted.fastest_Hz

    def rounded(shares: Array) -> Array:
        return np.array([_rounded_down(torque.largest_Nm * share) for share in shares])

    levels, ends = rounded(waveform.levels), rounded(waveform.ends)
    amplitudes = np.minimum(rounded(waveform.amplitudes), levels)
    slots = np.round(waveform.durations_s * rate).astype(np.intp)
    swings = amplitudes > 0
    periods = np.round(np.where(swings, waveform.periods_s, 0.0) * rate).astype(np.intp)
    phases = []
    for count, level, end, amplitude, period in zip(
        slots.tolist(),
        levels.tolist(),
        ends.tolist(),
        amplitudes.tolist(),
        periods.tolist(),
        strict=True,
    ):
        # Of as many digits as are written.
        swing = (amplitude, float(f"{rate / period:.12g}")) if period else (None, None)
        one = load(count / rate, level, end, *swing)
        phases.append(Phase(count / rate, one, one))
    return Setting(tuple(phases), slots, periods)


def _rounded_down(value: float) -> float:
    """So many digits of a torque, which must not become larger."""
    if value <= 0:
        return 0.0
    exponent = int(np.floor(np.log10(value))) - _DIGITS + 1
    return float(f"{np.floor(value / 10.0**exponent * (1 + 1e-12)):.0f}e{exponent}")
