"""The gripper: Figure 3, torque and voltage; 4 to 6, the linkage; 7, the comb drive."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Wedge

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.figures.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    PURPLE,
    SKY,
    figure,
    panel,
    save,
    styled,
)
from biogrip.physics import gripper as actuator
from biogrip.physics.gripper import LARGEST_M, SMALLEST_M, CombDrive, Gripper
from biogrip.physics.protocol import evaluate, join_phases
from biogrip.physics.response import simulated_response
from biogrip_study.config.study import Study
from biogrip_study.stages.job import job_study, logged, paths

if TYPE_CHECKING:
    snakemake: Any


def draw_comb(study: Study) -> Figure:
    """Draw all fingers, the first few enlarged, and eq. (9) with the operating points."""
    comb, steps = study.actuator, join_phases(study.phases)
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

    torques = np.unique(evaluate(steps, steps.time_s))
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
    history = join_phases(study.phases)
    # Include both sides of every jump, and enough points for ramps.
    grid = np.linspace(0, history.end_s, 4001)
    time_s = np.sort(np.concatenate((grid, history.time_s, np.nextafter(history.time_s, -1))))
    torque = np.maximum(evaluate(history, time_s), 0)
    ends = np.append(history.time_s, history.end_s)
    drawn = figure(COLUMN_IN, 3.0)
    upper, lower = drawn.subplots(2, 1, sharex=True, height_ratios=[1, 1.6])
    _curve(upper, time_s, ends, 1e9 * torque, "nN m", BLUE, "")
    upper.set_ylim(0, 1.4e9 * float(torque.max()))

    highest = 0.0
    for touching_Nm, colour, label in _touching(study):
        volts = actuator.voltage(comb, touching_Nm + torque)
        _curve(lower, time_s, ends, volts, "V", colour, label)
        highest = max(highest, float(volts.max()))
    lower.set_ylim(0, 1.5 * highest)
    lower.legend(loc="upper center", ncols=3, columnspacing=1.0)
    upper.set_ylabel("torque (nN m)")
    lower.set(ylabel="voltage (V)", xlabel="time (s)")
    drawn.align_ylabels()
    return drawn


def _touching(study: Study) -> Iterator[tuple[float, str, str]]:
    """Yield torques that hold the jaws at the extreme sample sizes, and zero, as in the paper."""
    for size_m, colour in ((SMALLEST_M, PURPLE), (LARGEST_M, GREEN)):
        try:
            found = study.config.gripper.contact(study.actuator, size_m)
        except BiogripError:
            # This gripper does not reach such a sample.
            continue
        yield found.torque_Nm, colour, f"{1e6 * size_m:g} µm"
    yield 0.0, ORANGE, "from contact"


def _curve(
    axes: Axes, time_s: Array, ends: Array, values: Array, unit: str, colour: str, label: str
) -> None:
    """Draw values, and annotate those that are held."""
    axes.plot(time_s, values, color=colour, linewidth=1.4, label=label)
    for start, end in pairwise(ends):
        here = values[(time_s >= start) & (time_s < end)]
        if np.ptp(here) < 1e-9 * values.max():
            text, place = f"{here[0]:.3g} {unit}", (0.5 * (start + end), here[0])
            style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": 7}
            axes.annotate(text, place, (0, 2), **style)


Place = tuple[float, float]

# Rotation that is visible in the drawing while arms still look like arms.
_VISIBLE_RAD = 0.012
# Of the drawing of names, exaggerated for legibility: degrees, arm lengths.
_HAT_DEG, _CLOSING_DEG, _GAP, _NODE = 72.0, 16.0, 2.3, 0.2


def draw_linkage(study: Study) -> Figure:
    """Draw linkage, tips, names of angles and displacements, and networks."""
    gripper = study.gripper
    drawn = figure(PAGE_IN, 4.8)
    (whole, tips), (names, networks) = drawn.subplots(2, 2, width_ratios=[1.15, 1])
    _whole(whole, gripper)
    panel(whole, "a", "linkage A-B-C-D, to scale")
    _tips(tips, gripper, _largest_rotation(study))
    panel(tips, "b", "tips B and C")
    _names(names)
    panel(names, "c", "angles and displacements, not to scale", most_letters=40)
    _networks(networks)
    panel(networks, "d", "the sample BC")
    for axes in (whole, tips, names):
        axes.set_aspect("equal", anchor="N")
    for axes in (whole, tips, names, networks):
        axes.set_axis_off()
    return drawn


def _joints(gripper: Gripper, closing: float, factor: float) -> dict[str, Place]:
    """Return positions of the four joints times a factor, with both arms closed by an angle."""
    length, angle = 1e3 * gripper.arm_length_m, math.radians(gripper.reference_angle_deg)
    base = 0.5e3 * LARGEST_M + length * math.cos(angle)
    x = factor * (-base + length * math.cos(angle - closing))
    y = factor * length * math.sin(angle - closing)
    return {"A": (-factor * base, 0), "B": (x, y), "C": (-x, y), "D": (factor * base, 0)}


def _line(axes: Axes, start: Place, end: Place, color: str, width: float, style: str = "-") -> None:
    axes.plot(*zip(start, end, strict=True), style, color=color, linewidth=width)


def _joint(axes: Axes, name: str, at: Place, label_at: Place, **options: Any) -> None:
    axes.plot(*at, "o", color="white", markeredgecolor=BLACK, markersize=4, zorder=4)
    axes.annotate(name, at, xytext=label_at, ha="center", **options)


def _arrow(axes: Axes, start: Place, end: Place, width: float = 1.0) -> None:
    style = {"arrowstyle": "->", "lw": width, "color": BLACK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style)


def _whole(axes: Axes, gripper: Gripper) -> None:
    joints = _joints(gripper, 0.0, 1.0)
    a, b, c, d = joints.values()
    for start, end, color, width in ((a, b, BLUE, 2.5), (d, c, BLUE, 2.5), (a, d, GREY, 1)):
        _line(axes, start, end, color, width)
    axes.add_patch(Circle((0, b[1]), 0.5e3 * LARGEST_M, color=ORANGE))
    for name, at in joints.items():
        _joint(axes, name, at, (-8 if at[0] < 0 else 8, -2), textcoords="offset points")
    angle = gripper.reference_angle_deg
    for foot, ends, label in ((a, angle, r"$\hat\theta_2$"), (d, 180 - angle, r"$\hat\theta_4$")):
        axes.add_patch(Arc(foot, 0.5, 0.5, theta1=0, theta2=ends, linewidth=0.8))
        axes.annotate(label, (foot[0] + 0.27, 0.1), fontsize=8)
    label, place = rf"$l$ = {1e3 * gripper.arm_length_m:g} mm", (0.5 * (a[0] + b[0]) - 0.08)
    axes.annotate(label, (place, 0.5 * b[1]), ha="right", fontsize=7)
    axes.annotate(rf"$\hat\theta_2$ = {angle:g}°", (0, -0.18), ha="center", fontsize=7)
    axes.set(xlim=(a[0] - 0.75, d[0] + 0.75), ylim=(-0.25, b[1] + 0.2))


def _largest_rotation(study: Study) -> float:
    """Return the largest rotation of all samples, or a visible one if there is none."""
    peaks = [0.0]
    for case in study.cases.values():
        time_s = np.linspace(0.0, case.torque.end_s, 401)
        device = case.gripper, case.network, case.torque
        rotation = simulated_response(*device, time_s)
        peaks.append(float(rotation.max()))
    return max(peaks) or _VISIBLE_RAD


def _tips(axes: Axes, gripper: Gripper, rotation: float) -> None:
    """Draw the tips at the reference and at the largest rotation, which is enlarged; in um."""
    times = max(1, round(_VISIBLE_RAD / rotation))
    enlarged = f" (drawn {times} times)" if times > 1 else ""
    reference, moved = (_joints(gripper, turn, 1e3) for turn in (0.0, times * rotation))
    for joints, color, label in (
        (reference, GREY, "reference"),
        (moved, BLUE, f"closed by {1e3 * rotation:.2g} mrad{enlarged}"),
    ):
        for foot, tip in (("A", "B"), ("D", "C")):
            _line(axes, joints[foot], joints[tip], color, 2)
        axes.plot([], [], color=color, linewidth=2, label=label)
    (b_x, y), (c_x, _) = moved["B"], moved["C"]
    radius = 0.5e6 * LARGEST_M
    axes.add_patch(Circle((0, reference["B"][1]), radius, fill=False, color=GREY))
    theta = np.linspace(0, 2 * np.pi, 200)
    height = radius**2 / c_x
    axes.fill(c_x * np.cos(theta), y + height * np.sin(theta), color=ORANGE, alpha=0.6)
    # Displacements of the tips along x are counted from the reference.
    level = reference["B"][1] + radius + 16
    for side, joint, x, angle in ((-1, "B", b_x, r"$\phi_2$"), (1, "C", c_x, r"$\phi_4$")):
        _arrow(axes, (x + side * 65, y - 80), (x + side * 5, y - 95))
        axes.annotate(angle, (x + side * 78, y - 80), ha="center", va="center")
        at_rest = reference[joint][0]
        _line(axes, (at_rest, level - 10), (at_rest, level + 8), BLACK, 0.6)
        _arrow(axes, (at_rest, level), (x, level))
        text, place = f"$u_{joint}$", (at_rest + 9 * side, level)
        axes.annotate(text, place, ha="left" if side > 0 else "right", va="center", fontsize=7)
    _arrow(axes, (-155, y + 30), (-110, y + 30))
    axes.annotate("$x$", (-105, y + 30), va="center", fontsize=7)
    _line(axes, (-30, y - 150), (70, y - 150), BLACK, 1.5)
    axes.annotate("100 µm", (20, y - 158), ha="center", va="top", fontsize=7)
    axes.set(xlim=(-160, 160), ylim=(y - 185, y + 165))
    axes.legend(loc="upper center", ncols=1)


def _names(axes: Axes) -> None:
    """Draw the linkage at the reference and deformed, with symbols for what changes."""
    hat, tilde = (math.radians(angle) for angle in (_HAT_DEG, _HAT_DEG - _CLOSING_DEG))
    base = math.cos(hat) + _GAP / 2
    b_hat, b = ((-base + math.cos(angle), math.sin(angle)) for angle in (hat, tilde))
    c_hat, c = ((-x, y) for x, y in (b_hat, b))
    for left, right, color, width in ((b_hat, c_hat, GREY, 1.2), (b, c, BLUE, 2.2)):
        _line(axes, (-base, 0), left, color, width)
        _line(axes, (base, 0), right, color, width)
    _line(axes, (-base, 0), (base, 0), GREY, 1)
    _line(axes, b_hat, c_hat, GREY, 0.8)
    # A Maxwell branch; x is the displacement of its inner node.
    y, size = b[1], (c[0] - b[0]) / 2.5
    _spring(axes, b[0], _NODE, y, "$k$", size)
    _damper(axes, _NODE, c[0], y, "$c$", size)
    axes.plot(_NODE, y, "o", color=ORANGE, markersize=4, zorder=4)
    for name, at in (("A", (-base, 0)), ("B", b), ("C", c), ("D", (base, 0))):
        _joint(axes, name, at, (at[0], at[1] - 0.19))
    _angles(axes, -base, 2, _HAT_DEG, _HAT_DEG - _CLOSING_DEG)
    _angles(axes, base, 4, 180 - _HAT_DEG, 180 - _HAT_DEG + _CLOSING_DEG)
    top = b_hat[1] + 0.14
    for start, end, name in (
        (b_hat[0], b[0], "$u_B$"),
        (c_hat[0], c[0], "$u_C$"),
        (0, _NODE, "$x$"),
    ):
        _arrow(axes, (start, top), (end, top), 0.9)
        place = (0.5 * (start + end), top + 0.04)
        axes.annotate(name, place, ha="center", va="bottom", fontsize=7.5)
    _line(axes, (0, y - 0.06), (0, top + 0.05), BLACK, 0.8, ":")
    _line(axes, (_NODE, y), (_NODE, top), BLACK, 0.8, ":")
    words = (
        r"$\theta_2=\tilde\theta_2-\hat\theta_2=-\phi_2$",
        r"$\theta_4=\tilde\theta_4-\hat\theta_4=\phi_4$",
    )
    axes.annotate("\n".join(words), (0, 0.33), ha="center", va="center", fontsize=7.5)
    axes.set(xlim=(-base - 0.25, base + 0.75), ylim=(-0.2, top + 0.25))


def _angles(axes: Axes, foot: float, index: int, hat: float, tilde: float) -> None:
    """Draw arcs of both angles in degrees, and the rotation between them."""

    def at(radius: float, angle_deg: float) -> Place:
        angle = math.radians(angle_deg)
        return foot + radius * math.cos(angle), radius * math.sin(angle)

    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7.5}
    for angle, size, color, symbol in ((hat, 0.36, GREY, "hat"), (tilde, 0.68, BLUE, "tilde")):
        axes.add_patch(Arc((foot, 0), size, size, theta1=0, theta2=angle, color=color, lw=0.9))
        place = at(size / 2 + 0.1, 0.35 * angle)
        axes.annotate(rf"$\{symbol}\theta_{index}$", place, color=color, **style)
    _arrow(axes, at(0.62, hat), at(0.62, tilde), 0.9)
    axes.annotate(rf"$\phi_{index}$", at(0.73, 0.5 * (hat + tilde)), **style)


def _networks(axes: Axes) -> None:
    """Draw the liquid drop with membrane (1) and generalized Maxwell model (2) of Figure 5."""
    for top, rows, title in (
        (4.3, ("kc", "k_p"), "(1) Maxwell liquid drop, membrane"),
        (1.6, ("kc", "k_p", "c_p"), "(2) generalized Maxwell-Wiechert"),
    ):
        heights = [top - 0.75 * i for i in range(len(rows))]
        axes.annotate(title, (2.5, top + 0.7), ha="center", fontsize=7)
        for x, name, offset in ((0.2, "B", -0.18), (4.8, "C", 0.18)):
            _line(axes, (x, heights[0]), (x, heights[-1]), BLACK, 1)
            middle = 0.5 * (heights[0] + heights[-1])
            _joint(axes, name, (x, middle), (x + offset, middle), va="center")
        for y, row in zip(heights, rows, strict=True):
            if row == "kc":
                _spring(axes, 0.2, 2.5, y, "$k$")
                _damper(axes, 2.5, 4.8, y, "$c$")
            elif row == "k_p":
                _spring(axes, 0.2, 4.8, y, "$k_p$")
            else:
                _damper(axes, 0.2, 4.8, y, "$c_p$")
    axes.set(xlim=(-0.2, 5.2), ylim=(-0.5, 5.5))


def _spring(axes: Axes, x0: float, x1: float, y: float, label: str, size: float = 1.0) -> None:
    """Draw a spring from x0 to x1 at a height."""
    middle = 0.5 * (x0 + x1)
    x = np.linspace(middle - 0.5 * size, middle + 0.5 * size, 9)
    zigzag = y + 0.14 * size * np.array([0, 1, -1, 1, -1, 1, -1, 1, 0])
    axes.plot([x0, *x, x1], [y, *zigzag, y], color=BLUE, linewidth=1)
    axes.annotate(label, (middle, y + 0.18 * size), ha="center", va="bottom", fontsize=7)


def _damper(axes: Axes, x0: float, x1: float, y: float, label: str, size: float = 1.0) -> None:
    """Draw a damper from x0 to x1 at a height."""
    middle, half, height = 0.5 * (x0 + x1), 0.3 * size, 0.15 * size
    left, right = middle - half, middle + half
    _line(axes, (x0, y), (middle, y), SKY, 1)
    _line(axes, (middle, y - 0.1 * size), (middle, y + 0.1 * size), SKY, 1.5)
    cup = [y + height, y + height, y - height, y - height]
    axes.plot([left, right, right, left], cup, color=SKY, linewidth=1)
    _line(axes, (right, y), (x1, y), SKY, 1)
    axes.annotate(label, (middle, y + 0.22 * size), ha="center", va="bottom", fontsize=7)


if __name__ == "__main__":
    with logged(snakemake), styled():
        of_job, made = job_study(snakemake), snakemake.output
        save(draw_comb(of_job), *paths(made.comb))
        save(draw_torque(of_job), *paths(made.torque))
        save(draw_linkage(of_job.of(of_job.gripped)), *paths(made.linkage))
