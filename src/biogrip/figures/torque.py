"""Figure 3: the torque that the comb drives exert, and the voltage it takes."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from biogrip import actuator
from biogrip.figures.style import BLUE, COLUMN_IN, ORANGE, figure
from biogrip.protocol import duration_s, torque_at, torque_steps
from biogrip.study import build


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw torque and voltage of the left arm against time."""
    phases = build.phases(settings["protocol"])
    comb = build.comb_drive(settings["actuator"])
    steps = torque_steps(phases)
    ends = np.append(steps.time_s, duration_s(phases))
    torque = torque_at(steps, steps.time_s)
    volts = actuator.voltage(comb, torque)
    drawn = figure(COLUMN_IN, 2.2)
    left, right = drawn.subplots(2, 1, sharex=True)
    left.stairs(1e9 * torque, ends, baseline=0, color=BLUE, linewidth=1.4)
    left.set_ylabel("torque (nN m)")
    right.stairs(volts, ends, baseline=0, color=ORANGE, linewidth=1.4)
    right.set_ylabel("voltage (V)")
    right.set_xlabel("time (s)")
    for axes, values, form in (
        (left, 1e9 * torque, "{:.3g} nN m"),
        (right, volts, "{:.3g} V"),
    ):
        axes.set_ylim(0, 1.35 * values.max())
        for start, end, value in zip(ends, ends[1:], values, strict=False):
            axes.annotate(
                form.format(value),
                (0.5 * (start + end), value),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=7,
            )
    drawn.align_ylabels()
    return drawn
