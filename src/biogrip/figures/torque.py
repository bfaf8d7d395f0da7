"""Figure 3: torque and voltage of the comb drives over time."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.figures.style import BLUE, COLUMN_IN, GREEN, ORANGE, PURPLE, figure
from biogrip.physics import actuator
from biogrip.physics.contact import LARGEST_M, SMALLEST_M, contact
from biogrip.physics.protocol import torque_at, torque_history
from biogrip.study.study import Study


def draw(study: Study) -> Figure:
    """Draw torque and voltage of both arms against time."""
    comb = study.actuator
    history = torque_history(study.phases)
    # Include both sides of every jump, and enough points for ramps and sinusoids.
    grid = np.linspace(0, history.end_s, 4001)
    time_s = np.sort(np.concatenate((grid, history.time_s, np.nextafter(history.time_s, -1))))
    arms = [np.maximum(torque_at(history, time_s, arm), 0) for arm in ("left", "right")]
    ends = np.append(history.time_s, history.end_s)
    drawn = figure(COLUMN_IN, 3.0)
    upper, lower = drawn.subplots(2, 1, sharex=True, height_ratios=[1, 1.6])
    _line(upper, time_s, ends, [1e9 * torque for torque in arms], "nN m", BLUE, "")
    most = 1e9 * max(float(torque.max()) for torque in arms)
    upper.set_ylim(0, 1.4 * most)

    highest = 0.0
    for touching_Nm, colour, label in _touching(study):
        volts = [actuator.voltage(comb, touching_Nm + torque) for torque in arms]
        _line(lower, time_s, ends, volts, "V", colour, label)
        highest = max(highest, *(float(v.max()) for v in volts))
    lower.set_ylim(0, 1.5 * highest)
    lower.legend(loc="upper center", ncols=3, columnspacing=1.0)
    if not history.symmetric:
        upper.plot([], [], "--", color=BLUE, linewidth=1, label="right arm")
        upper.legend()
    upper.set_ylabel("torque (nN m)")
    lower.set(ylabel="voltage (V)", xlabel="time (s)")
    drawn.align_ylabels()
    return drawn


def _touching(study: Study) -> Iterator[tuple[float, str, str]]:
    """Yield torques that hold the jaws at the extreme sample sizes, and zero, as in the paper."""
    for size_m, colour in ((SMALLEST_M, PURPLE), (LARGEST_M, GREEN)):
        try:
            found = contact(study.gripper, study.jaw_gap_m, study.actuator, size_m)
        except BiogripError:
            # This gripper does not reach such a sample.
            continue
        yield found.torque_Nm, colour, f"{1e6 * size_m:g} µm"
    yield 0.0, ORANGE, "from contact"


def _line(
    axes: Axes,
    time_s: Array,
    ends: Array,
    arms: list[Array],
    unit: str,
    colour: str,
    label: str,
) -> None:
    """Draw the values of both arms, and annotate held values."""
    left, right = arms
    axes.plot(time_s, left, color=colour, linewidth=1.4, label=label)
    if not np.array_equal(left, right):
        axes.plot(time_s, right, "--", color=colour, linewidth=1)
    for start, end in pairwise(ends):
        here = left[(time_s >= start) & (time_s < end)]
        if np.ptp(here) < 1e-9 * left.max():
            axes.annotate(
                f"{here[0]:.3g} {unit}",
                (0.5 * (start + end), here[0]),
                xytext=(0, 2),
                textcoords="offset points",
                ha="center",
                fontsize=7,
            )
