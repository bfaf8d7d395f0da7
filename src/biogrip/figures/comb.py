"""Figure 7: the comb drive to scale, and its torque against voltage."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from biogrip.figures.style import BLACK, BLUE, ORANGE, PAGE_IN, figure, panel
from biogrip.physics import actuator
from biogrip.physics.actuator import CombDrive
from biogrip.physics.protocol import torque_at, torque_history
from biogrip.study.study import Study


def draw(study: Study) -> Figure:
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
    for v, t in zip(volts, torques, strict=True):
        curve.annotate(
            f"{v:.3g} V, {1e9 * t:.3g} nN m",
            (v, 1e9 * t),
            xytext=(-6, 4) if v > 0.5 * grid[-1] else (6, -6),
            textcoords="offset points",
            ha="right" if v > 0.5 * grid[-1] else "left",
            fontsize=7,
        )
    curve.set(xlim=(0, grid[-1]), ylim=0, xlabel="voltage (V)", ylabel="torque (nN m)")
    panel(curve, "c", "torque, eq. (9)")
    return drawn


def _fingers(axes: Axes, comb: CombDrive, count: int, turned_deg: float = 0.0) -> None:
    """Draw floating and fixed fingers as they overlap at rest, in micrometres."""
    half = 0.5 * comb.initial_overlap_deg
    fingers = []
    for i in range(count):
        radius = comb.first_radius_m + i * comb.pitch_m
        fixed = radius + comb.finger_width_m + comb.finger_gap_m
        fingers.append((radius, (90 - half, 90 - half + comb.finger_angle_deg), BLUE))
        fingers.append((fixed, (90 + half - comb.finger_angle_deg, 90 + half), ORANGE))
    for colour in (BLUE, ORANGE):
        wedges = [
            Wedge(
                (0, 0),
                1e6 * (r + comb.finger_width_m),
                *(angle + turned_deg for angle in angles),
                width=1e6 * comb.finger_width_m,
            )
            for r, angles, c in fingers
            if c == colour
        ]
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
    axes.annotate(
        f"$g$ = {g:g} µm",
        (-edge - 4, r + d + g / 2),
        va="center",
        ha="right",
        fontsize=7,
    )
    axes.annotate("", (-edge, r - 2.5), (edge, r - 2.5), arrowprops=arrow)
    text = f"overlap {comb.initial_overlap_deg:g}°, $r_0$ = {r:g} µm"
    axes.annotate(text, (0, r - 5), ha="center", va="top", fontsize=7)
