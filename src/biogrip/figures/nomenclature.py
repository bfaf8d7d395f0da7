"""Figure 6: names of the linkage's angles and displacements."""

import math

from matplotlib.axes import Axes
from matplotlib.patches import Arc

from biogrip.figures.elements import damper, spring
from biogrip.figures.style import BLACK, BLUE, GREY, ORANGE

# Exaggerated for legibility: degrees, arm lengths.
_HAT_DEG, _CLOSING_DEG, _GAP, _NODE = 72.0, 16.0, 2.3, 0.2


def nomenclature(axes: Axes) -> None:
    """Draw the linkage at the reference and deformed, with symbols for what changes."""
    hat, tilde = (math.radians(a) for a in (_HAT_DEG, _HAT_DEG - _CLOSING_DEG))
    base = math.cos(hat) + _GAP / 2
    b_hat, b = ((-base + math.cos(a), math.sin(a)) for a in (hat, tilde))
    c_hat, c = ((-x, y) for x, y in (b_hat, b))
    for left, right, colour, width in ((b_hat, c_hat, GREY, 1.2), (b, c, BLUE, 2.2)):
        for foot, tip in (((-base, 0), left), ((base, 0), right)):
            axes.plot(*zip(foot, tip, strict=True), color=colour, linewidth=width)
    axes.plot([-base, base], [0, 0], color=GREY, linewidth=1)
    axes.plot([b_hat[0], c_hat[0]], [b_hat[1]] * 2, color=GREY, linewidth=0.8)
    _sample(axes, b[0], c[0], b[1])
    for name, (x, y) in (("A", (-base, 0)), ("B", b), ("C", c), ("D", (base, 0))):
        axes.plot(x, y, "o", color="white", markeredgecolor=BLACK, markersize=4, zorder=4)
        axes.annotate(name, (x, y - 0.19), ha="center")
    _angles(axes, -base, 2, _HAT_DEG, _HAT_DEG - _CLOSING_DEG)
    _angles(axes, base, 4, 180 - _HAT_DEG, 180 - _HAT_DEG + _CLOSING_DEG)
    top = b_hat[1] + 0.14
    _shift(axes, b_hat[0], b[0], top, r"$u_B$")
    _shift(axes, c_hat[0], c[0], top, r"$u_C$")
    axes.plot([0, 0], [b[1] - 0.06, top + 0.05], ":", color=BLACK, linewidth=0.8)
    _shift(axes, 0, _NODE, top, "$x$")
    axes.plot([_NODE] * 2, [b[1], top], ":", color=BLACK, linewidth=0.8)
    axes.annotate(
        r"$\theta_2=\tilde\theta_2-\hat\theta_2=-\phi_2$"
        "\n"
        r"$\theta_4=\tilde\theta_4-\hat\theta_4=\phi_4$",
        (0, 0.33),
        ha="center",
        va="center",
        fontsize=7.5,
    )
    axes.set(xlim=(-base - 0.25, base + 0.75), ylim=(-0.2, top + 0.25))
    axes.set_aspect("equal", anchor="N")
    axes.set_axis_off()


def _sample(axes: Axes, left: float, right: float, y: float) -> None:
    """Draw a Maxwell branch; x is the displacement of its inner node."""
    size = (right - left) / 2.5
    spring(axes, left, _NODE, y, "$k$", size)
    damper(axes, _NODE, right, y, "$c$", size)
    axes.plot(_NODE, y, "o", color=ORANGE, markersize=4, zorder=4)


def _angles(axes: Axes, foot: float, index: int, hat: float, tilde: float) -> None:
    """Draw arcs of both angles, and the rotation between them."""
    for angle, size, colour, name in (
        (hat, 0.36, GREY, rf"$\hat\theta_{index}$"),
        (tilde, 0.68, BLUE, rf"$\tilde\theta_{index}$"),
    ):
        axes.add_patch(Arc((foot, 0), size, size, theta1=0, theta2=angle, color=colour, lw=0.9))
        middle = math.radians(0.35 * angle)
        r = size / 2 + 0.1
        place = (foot + r * math.cos(middle), r * math.sin(middle))
        axes.annotate(name, place, ha="center", va="center", fontsize=7.5, color=colour)
    start, end = (math.radians(angle) for angle in (hat, tilde))
    r = 0.62
    axes.annotate(
        "",
        (foot + r * math.cos(end), r * math.sin(end)),
        (foot + r * math.cos(start), r * math.sin(start)),
        arrowprops={"arrowstyle": "->", "lw": 0.9, "color": BLACK, "shrinkA": 0, "shrinkB": 0},
    )
    middle = 0.5 * (start + end)
    place = (foot + (r + 0.11) * math.cos(middle), (r + 0.11) * math.sin(middle))
    axes.annotate(rf"$\phi_{index}$", place, ha="center", va="center", fontsize=7.5)


def _shift(axes: Axes, start: float, end: float, y: float, name: str) -> None:
    arrow = {"arrowstyle": "->", "lw": 0.9, "color": BLACK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (end, y), (start, y), arrowprops=arrow)
    axes.annotate(name, (0.5 * (start + end), y + 0.04), ha="center", va="bottom", fontsize=7.5)
