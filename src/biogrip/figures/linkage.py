"""Figures 4 to 6: the gripper as a linkage, to scale, and the sample's two networks."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from biogrip.figures.elements import damper, spring
from biogrip.figures.nomenclature import nomenclature
from biogrip.figures.style import BLACK, BLUE, GREY, ORANGE, PAGE_IN, figure, panel
from biogrip.physics.contact import LARGEST_M
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import torque_history
from biogrip.physics.simulation import simulated_rotation
from biogrip.stages.model_difference import network_of
from biogrip.study.study import Study

_ARROW = {"arrowstyle": "->", "lw": 1, "color": BLACK, "shrinkA": 0, "shrinkB": 0}


# Rotation that is visible in the drawing while arms still look like arms.
_VISIBLE_RAD = 0.012


def draw(study: Study) -> Figure:
    """Draw linkage, tips, nomenclature and networks."""
    gripper = study.gripper
    drawn = figure(PAGE_IN, 4.8)
    (whole, tips), (names, networks) = drawn.subplots(2, 2, width_ratios=[1.15, 1])
    _linkage(whole, gripper)
    panel(whole, "a", "linkage A-B-C-D, to scale")
    _tips(tips, gripper, _largest_rotation_rad(study))
    panel(tips, "b", "tips B and C")
    nomenclature(names)
    panel(names, "c", "angles and displacements, not to scale", most_letters=40)
    _networks(networks)
    panel(networks, "d", "the sample BC")
    return drawn


def _joints(gripper: Gripper, closing_rad: float = 0.0) -> dict[str, tuple[float, float]]:
    """Return positions of the four joints in millimetres, with both arms closed by an angle."""
    length, angle = (
        1e3 * gripper.arm_length_m,
        math.radians(gripper.reference_angle_deg),
    )
    base = 0.5e3 * LARGEST_M + length * math.cos(angle)
    tip_x = -base + length * math.cos(angle - closing_rad)
    tip_y = length * math.sin(angle - closing_rad)
    return {"A": (-base, 0), "B": (tip_x, tip_y), "C": (-tip_x, tip_y), "D": (base, 0)}


def _linkage(axes: Axes, gripper: Gripper) -> None:
    joints = _joints(gripper)
    axes.plot(*zip(joints["A"], joints["B"], strict=True), color=BLUE, linewidth=2.5)
    axes.plot(*zip(joints["D"], joints["C"], strict=True), color=BLUE, linewidth=2.5)
    axes.plot(*zip(joints["A"], joints["D"], strict=True), color=GREY, linewidth=1)
    middle = joints["B"][1]
    axes.add_patch(Circle((0, middle), 0.5e3 * LARGEST_M, color=ORANGE))
    for name, (x, y) in joints.items():
        axes.plot(x, y, "o", color="white", markeredgecolor=BLACK, markersize=4)
        side = -1 if x < 0 else 1
        axes.annotate(name, (x, y), xytext=(8 * side, -2), textcoords="offset points", ha="center")
    a, d = joints["A"], joints["D"]
    angle = gripper.reference_angle_deg
    axes.add_patch(Arc(a, 0.5, 0.5, theta1=0, theta2=angle, linewidth=0.8))
    axes.add_patch(Arc(d, 0.5, 0.5, theta1=0, theta2=180 - angle, linewidth=0.8))
    axes.annotate(r"$\hat\theta_2$", (a[0] + 0.27, 0.1), fontsize=8)
    axes.annotate(r"$\hat\theta_4$", (d[0] + 0.27, 0.1), fontsize=8)
    label = rf"$l$ = {1e3 * gripper.arm_length_m:g} mm"
    axes.annotate(
        label,
        (0.5 * (a[0] + joints["B"][0]) - 0.08, 0.5 * middle),
        ha="right",
        fontsize=7,
    )
    axes.annotate(rf"$\hat\theta_2$ = {angle:g}°", (0, -0.18), ha="center", fontsize=7)
    axes.set(xlim=(a[0] - 0.75, d[0] + 0.75), ylim=(-0.25, middle + 0.2))
    axes.set_aspect("equal", anchor="N")
    axes.set_axis_off()


def _largest_rotation_rad(study: Study) -> float:
    """Return the largest rotation of all samples, or a visible one if there is none."""
    peaks = [0.0]
    for case in study.cases.values():
        torque = torque_history(case.phases)
        time_s = np.linspace(0.0, torque.end_s, 401)
        rotation = simulated_rotation(
            case.gripper, network_of(case), torque, time_s, nonlinear=False
        )
        peaks.append(float(rotation.max()))
    return max(peaks) or _VISIBLE_RAD


def _tips(axes: Axes, gripper: Gripper, rotation_rad: float) -> None:
    """Draw the tips at the reference and at the largest rotation, which is enlarged."""
    times = max(1, round(_VISIBLE_RAD / rotation_rad))
    enlarged = f" (drawn {times} times)" if times > 1 else ""
    reference, moved = (
        {name: (1e3 * x, 1e3 * y) for name, (x, y) in _joints(gripper, turned).items()}
        for turned in (0.0, times * rotation_rad)
    )
    for joints, colour, label in (
        (reference, GREY, "reference"),
        (moved, BLUE, f"closed by {1e3 * rotation_rad:.2g} mrad{enlarged}"),
    ):
        for foot, tip in (("A", "B"), ("D", "C")):
            axes.plot(*zip(joints[foot], joints[tip], strict=True), color=colour, linewidth=2)
        axes.plot([], [], color=colour, linewidth=2, label=label)
    (b_x, b_y), (c_x, _) = moved["B"], moved["C"]
    height = 1e6 * LARGEST_M
    axes.add_patch(Circle((0, reference["B"][1]), height / 2, fill=False, color=GREY))
    theta = np.linspace(0, 2 * np.pi, 200)
    axes.fill(
        c_x * np.cos(theta),
        b_y + height**2 / 4 / c_x * np.sin(theta),
        color=ORANGE,
        alpha=0.6,
    )
    for side, name, wrist in ((-1, r"$\phi_2$", b_x), (1, r"$\phi_4$", c_x)):
        axes.annotate(
            "",
            (wrist + side * 5, b_y - 95),
            (wrist + side * 65, b_y - 80),
            arrowprops=_ARROW,
        )
        axes.annotate(name, (wrist + side * 78, b_y - 80), ha="center", va="center")
    # Displacements of the tips along x, counted from the reference.
    level = reference["B"][1] + height / 2 + 16
    for text, at_rest, at_end, shift in (
        ("$u_B$", reference["B"][0], b_x, -9),
        ("$u_C$", reference["C"][0], c_x, 9),
    ):
        axes.plot([at_rest, at_rest], [level - 10, level + 8], color=BLACK, linewidth=0.6)
        axes.annotate("", (at_end, level), (at_rest, level), arrowprops=_ARROW)
        label_at = (at_rest + shift, level)
        axes.annotate(text, label_at, ha="left" if shift > 0 else "right", va="center", fontsize=7)
    start = (-155, b_y + 30)
    axes.annotate("", (start[0] + 45, start[1]), start, arrowprops=_ARROW)
    axes.annotate("$x$", (start[0] + 50, start[1]), va="center", fontsize=7)
    axes.plot([-30, 70], [b_y - 150, b_y - 150], color=BLACK, linewidth=1.5)
    axes.annotate("100 µm", (20, b_y - 158), ha="center", va="top", fontsize=7)
    axes.set(xlim=(-160, 160), ylim=(b_y - 185, b_y + 165))
    axes.set_aspect("equal", anchor="N")
    axes.set_axis_off()
    axes.legend(loc="upper center", ncols=1)


def _networks(axes: Axes) -> None:
    """Draw the liquid drop with membrane (1) and generalized Maxwell model (2) of Figure 5."""
    for top, rows, title in (
        (4.3, ("kc", "k_p"), "(1) Maxwell liquid drop, membrane"),
        (1.6, ("kc", "k_p", "c_p"), "(2) generalized Maxwell-Wiechert"),
    ):
        heights = [top - 0.75 * i for i in range(len(rows))]
        axes.annotate(title, (2.5, top + 0.5), ha="center", fontsize=7)
        for x, name, offset in ((0.2, "B", -0.18), (4.8, "C", 0.18)):
            axes.plot([x, x], [heights[0], heights[-1]], color=BLACK, linewidth=1)
            mid = 0.5 * (heights[0] + heights[-1])
            axes.plot(
                x,
                mid,
                "o",
                color="white",
                markeredgecolor=BLACK,
                markersize=4,
                zorder=3,
            )
            axes.annotate(name, (x + offset, mid), ha="center", va="center")
        for y, row in zip(heights, rows, strict=True):
            if row == "kc":
                spring(axes, 0.2, 2.5, y, "$k$")
                damper(axes, 2.5, 4.8, y, "$c$")
            elif row == "k_p":
                spring(axes, 0.2, 4.8, y, "$k_p$")
            else:
                damper(axes, 0.2, 4.8, y, "$c_p$")
    axes.set(xlim=(-0.2, 5.2), ylim=(-0.5, 5.2))
    axes.set_axis_off()
