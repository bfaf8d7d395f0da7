"""Symbols of springs and dampers."""

import numpy as np
from matplotlib.axes import Axes

from biogrip.figures.style import BLUE, SKY


def spring(axes: Axes, x0: float, x1: float, y: float, label: str, size: float = 1.0) -> None:
    """Draw a spring from x0 to x1 at a height."""
    middle = 0.5 * (x0 + x1)
    x = np.linspace(middle - 0.5 * size, middle + 0.5 * size, 9)
    zigzag = y + 0.14 * size * np.array([0, 1, -1, 1, -1, 1, -1, 1, 0])
    axes.plot([x0, *x, x1], [y, *zigzag, y], color=BLUE, linewidth=1)
    axes.annotate(label, (middle, y + 0.18 * size), ha="center", va="bottom", fontsize=7)


def damper(axes: Axes, x0: float, x1: float, y: float, label: str, size: float = 1.0) -> None:
    """Draw a damper from x0 to x1 at a height."""
    middle, half, height = 0.5 * (x0 + x1), 0.3 * size, 0.15 * size
    axes.plot([x0, middle], [y, y], color=SKY, linewidth=1)
    axes.plot([middle, middle], [y - 0.1 * size, y + 0.1 * size], color=SKY, linewidth=1.5)
    axes.plot(
        [middle - half, middle + half, middle + half, middle - half],
        [y + height, y + height, y - height, y - height],
        color=SKY,
        linewidth=1,
    )
    axes.plot([middle + half, x1], [y, y], color=SKY, linewidth=1)
    axes.annotate(label, (middle, y + 0.18 * size), ha="center", va="bottom", fontsize=7)
