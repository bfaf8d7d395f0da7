"""Rounding of torques to values that can be set: few digits, and whole slots of the camera."""

from collections.abc import Sequence

import numpy as np

from biogrip.design.experiment import DesignInputs
from biogrip.design.rating import Torque
from biogrip.design.waveform import hold
from biogrip.experiment.protocol import Load, Phase, load

_DIGITS = 4


def set_values(inputs: DesignInputs, torque: Torque) -> tuple[Phase, ...]:
    """Round a torque to values that can be set, both arms alike; no torque becomes larger."""
    waveform, rate = torque.waveform, inputs.fastest_Hz
    levels, ends, amplitudes = (
        [_rounded_down(torque.largest_Nm * share) for share in shares]
        for shares in (waveform.levels, waveform.ends, waveform.amplitudes)
    )
    columns = (waveform.durations_s, levels, ends, amplitudes, waveform.periods_s)
    phases = []
    for lasting_s, level, end, amplitude, period_s in zip(*columns, strict=True):
        duration_s = round(lasting_s * rate) / rate
        one = load(duration_s, level, end)
        if amplitude > 0:
            # With as many digits as are written to files.
            frequency_Hz = float(f"{rate / round(period_s * rate):.12g}")
            one = load(duration_s, level, end, min(amplitude, level), frequency_Hz)
        phases.append(Phase(duration_s, one, one))
    return tuple(phases)


def torque_of(inputs: DesignInputs, phases: Sequence[Phase]) -> Torque | None:
    """Return a train of steps that is held, the inverse of `set_values`; else nothing.

    Nothing, too, for one outside the limits, or of unlike arms.
    """
    limits = inputs.limits
    levels = np.array([phase.left.value_Nm for phase in phases])
    durations_s = np.array([phase.duration_s for phase in phases])
    units = durations_s / limits.shortest_s
    if (
        any(
            phase.left != phase.right or phase.left != Load(phase.left.value_Nm) for phase in phases
        )
        or not np.allclose(units, np.rint(units), rtol=0, atol=1e-6)
        or round(limits.longest_s / limits.shortest_s) != round(units.sum())
        or len(phases) > limits.most_steps
        or not 0 <= levels.min() < levels.max() <= inputs.largest_Nm * (1 + 1e-12)
    ):
        return None
    return Torque(hold(durations_s, levels / levels.max()), float(levels.max()))


def _rounded_down(value: float) -> float:
    """Round a torque down to a few digits."""
    if value <= 0:
        return 0.0
    exponent = int(np.floor(np.log10(value))) - _DIGITS + 1
    return float(f"{np.floor(value / 10.0**exponent * (1 + 1e-12)):.0f}e{exponent}")
