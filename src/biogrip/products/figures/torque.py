"""Figure 3: the torque that the comb drives exert, and the voltage it takes."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from biogrip.experiment.protocol import Phase, torque_at, torque_history
from biogrip.instrument import actuator
from biogrip.instrument.actuator import CombDrive
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import BLUE, COLUMN_IN, ORANGE, figure
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """The protocol, and the comb drives."""

    phases: tuple[Phase, ...]
    actuator: CombDrive


def settings(study: Study) -> Settings:
    """Choose protocol and comb drives."""
    return Settings(study.phases, study.actuator)


def draw(settings: Settings) -> Figure:
    """Draw torque and voltage of the left arm against time."""
    comb = settings.actuator
    history = torque_history(settings.phases)
    # Both sides of every jump, and enough points for ramps and sinusoids.
    grid = np.linspace(0, history.end_s, 4001)
    time_s = np.sort(np.concatenate((grid, history.time_s, np.nextafter(history.time_s, -1))))
    torque = torque_at(history, time_s)
    right = torque_at(history, time_s, "right")
    volts = actuator.voltage(comb, np.maximum(torque, 0))
    drawn = figure(COLUMN_IN, 2.5)
    upper, lower = drawn.subplots(2, 1, sharex=True)
    ends = np.append(history.time_s, history.end_s)
    for axes, values, unit, colour in (
        (upper, 1e9 * torque, "nN m", BLUE),
        (lower, volts, "V", ORANGE),
    ):
        axes.plot(time_s, values, color=colour, linewidth=1.4)
        axes.set_ylim(0, 1.35 * values.max())
        for start, end in pairwise(ends):
            here = values[(time_s >= start) & (time_s < end)]
            if np.ptp(here) < 1e-9 * values.max():
                axes.annotate(
                    f"{here[0]:.3g} {unit}",
                    (0.5 * (start + end), here[0]),
                    xytext=(0, 3),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7,
                )
    if not history.symmetric:
        upper.plot(time_s, 1e9 * right, "--", color=BLUE, linewidth=1, label="right arm")
        lower.plot(time_s, actuator.voltage(comb, np.maximum(right, 0)), "--", color=ORANGE)
        upper.set_ylim(0, 1.35e9 * max(torque.max(), right.max()))
        lower.set_ylim(0, 1.35 * float(actuator.voltage(comb, max(torque.max(), right.max()))))
        upper.legend()
    upper.set_title("to grip; closing the jaws comes on top", fontsize=7.5)
    upper.set_ylabel("torque (nN m)")
    lower.set_ylabel("voltage (V)")
    lower.set_xlabel("time (s)")
    drawn.align_ylabels()
    return drawn


TORQUE = drawing(
    draw,
    name="torque",
    caption="Figure 3 of the paper: torque of each comb drive that grips the sample, and "
    "the voltage it takes by eq. (9). What closes the jaws onto a sample comes on top, see the "
    "table of contacts.",
    settings=settings,
    sheet="study_figures",
)
