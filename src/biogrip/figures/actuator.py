"""The comb drive: Figure 7 to scale, with its torque; Figure 3, torque and voltage over time."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.figures.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    ORANGE,
    PAGE_IN,
    PURPLE,
    figure,
    panel,
)
from biogrip.physics import actuator
from biogrip.physics.actuator import CombDrive
from biogrip.physics.contact import LARGEST_M, SMALLEST_M, contact
from biogrip.physics.protocol import torque_at, torque_history
from biogrip.study.study import Study


def draw_comb(study: Study) -> Figure:
    """Draw all fingers, the first few enlarged, and eq. (9) with the operating points."""
    comb, steps = study.actuator, torque_history(study.phases)
    drawn = figure(PAGE_IN, 4.4)
    places = drawn.add_gridspec(2, 2, height_ratios=[1.0, 1.3], width_ratios=[1.1, 1.0])
    whole = drawn.add_subplot(places[0, :])
    detail, curve = (drawn.add_subplot(places[1, column]) for column in range(2))

    # Turned by 90 degrees, the comb fits the width of the page.
    _fingers(whole, comb, comb.fingers, turned_deg=-90)
    panel(whole, "a", f"all {comb.fingers} fingers")
    _scale_bar(whole, comb, 200)

    shown = 3
    _fingers(detail, comb, shown)
    panel(detail, "b", "the innermost, enlarged")
    _dimensions(detail, comb)
    detail.set_ylim(1e6 * comb.first_radius_m - 9, 1e6 * comb.first_radius_m + 14 * shown + 4)

    torques = np.unique(torque_at(steps, steps.time_s))
    torques = torques[torques > 0]
    volts = actuator.voltage(comb, torques)
    grid = np.linspace(0, 1.25 * volts.max(), 200)
    curve.plot(grid, 1e9 * actuator.torque(comb, grid), color=BLUE)
    curve.plot(volts, 1e9 * torques, "o", color=ORANGE, markersize=4)
    for v, t in zip(volts, 1e9 * torques, strict=True):
        right = v > 0.5 * grid[-1]
        text, side = f"{v:.3g} V, {t:.3g} nN m", "right" if right else "left"
        offset = (-6, 4) if right else (6, -6)
        curve.annotate(text, (v, t), offset, textcoords="offset points", ha=side, fontsize=7)
    curve.set(xlim=(0, grid[-1]), ylim=0, xlabel="voltage (V)", ylabel="torque (nN m)")
    panel(curve, "c", "torque, eq. (9)")
    return drawn


def _fingers(axes: Axes, comb: CombDrive, count: int, turned_deg: float = 0.0) -> None:
    """Draw floating and fixed fingers as they overlap at rest, in micrometres."""
    half, finger = 0.5 * comb.initial_overlap_deg, comb.finger_angle_deg
    width, shift = comb.finger_width_m, comb.finger_width_m + comb.finger_gap_m
    middle = 90 + turned_deg
    for colour, first, angles in (
        (BLUE, comb.first_radius_m, (middle - half, middle - half + finger)),
        (ORANGE, comb.first_radius_m + shift, (middle + half - finger, middle + half)),
    ):
        outer = 1e6 * (first + np.arange(count) * comb.pitch_m + width)
        wedges = [Wedge((0, 0), radius, *angles, width=1e6 * width) for radius in outer]
        axes.add_collection(PatchCollection(wedges, facecolor=colour, edgecolor="none"))
    axes.set_aspect("equal", anchor="N")
    axes.autoscale_view()
    axes.set_axis_off()


def _scale_bar(axes: Axes, comb: CombDrive, length_um: float) -> None:
    """Draw a scale bar below the comb, and label floating and fixed fingers."""
    first, last = 1e6 * comb.first_radius_m, 1e6 * comb.outer_radius_m
    reach = last * math.sin(math.radians(comb.finger_angle_deg - 0.5 * comb.initial_overlap_deg))
    y = -0.9 * reach
    axes.plot([first, first + length_um], [y, y], color=BLACK, linewidth=1.5)
    axes.annotate(f"{length_um:g} µm", (first + length_um + 8, y), va="center", fontsize=7)
    for text, side, colour in (("floating", 1, BLUE), ("fixed", -1, ORANGE)):
        place = (first, side * 0.65 * reach)
        axes.annotate(text, place, ha="left", va="center", color=colour, fontsize=7)


def _dimensions(axes: Axes, comb: CombDrive) -> None:
    """Mark finger width d, gap g, first radius r_0 and the overlap."""
    r, d, g = (1e6 * v for v in (comb.first_radius_m, comb.finger_width_m, comb.finger_gap_m))
    edge = r * math.sin(math.radians(0.5 * comb.initial_overlap_deg))
    arrow = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (edge + 2, r), (edge + 2, r + d), arrowprops=arrow)
    axes.annotate(f"$d$ = {d:g} µm", (edge + 4, r + d / 2), va="center", fontsize=7)
    axes.annotate("", (-edge - 2, r + d), (-edge - 2, r + d + g), arrowprops=arrow)
    place = (-edge - 4, r + d + g / 2)
    axes.annotate(f"$g$ = {g:g} µm", place, va="center", ha="right", fontsize=7)
    axes.annotate("", (-edge, r - 2.5), (edge, r - 2.5), arrowprops=arrow)
    text = f"overlap {comb.initial_overlap_deg:g}°, $r_0$ = {r:g} µm"
    axes.annotate(text, (0, r - 5), ha="center", va="top", fontsize=7)


def draw_torque(study: Study) -> Figure:
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
    axes: Axes, time_s: Array, ends: Array, arms: list[Array], unit: str, colour: str, label: str
) -> None:
    """Draw the values of both arms, and annotate held values."""
    left, right = arms
    axes.plot(time_s, left, color=colour, linewidth=1.4, label=label)
    if not np.array_equal(left, right):
        axes.plot(time_s, right, "--", color=colour, linewidth=1)
    for start, end in pairwise(ends):
        here = left[(time_s >= start) & (time_s < end)]
        if np.ptp(here) < 1e-9 * left.max():
            text, place = f"{here[0]:.3g} {unit}", (0.5 * (start + end), here[0])
            style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": 7}
            axes.annotate(text, place, (0, 2), **style)
