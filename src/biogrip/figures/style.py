"""Common style of all figures: legible at column width, safe for colour-blind readers.

Ticks of logarithmic axes are plain text, as math text would take a tenth of a figure's time.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import matplotlib as mpl
import numpy as np
import PIL.Image
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation

from biogrip.arrays import Array
from biogrip.digits import SUPERSCRIPTS
from biogrip.files import atomic_write

COLUMN_IN, PAGE_IN = 3.5, 7.2

# Okabe and Ito's palette.
BLACK, GREY = "#000000", "#999999"
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"
SKY, PURPLE = "#56B4E9", "#CC79A7"
SHADE = "#DCE6EE"

# Colours have the same meaning in all figures.
TARGET, MEASURED, FITTED, PAPER, ALL_SEEDS = BLACK, SKY, ORANGE, GREEN, GREY
# Of the first run in each basin.
RUNS = (FITTED, BLUE)

COLORS = {"grey": GREY, "blue": BLUE, "vermilion": ORANGE, "green": GREEN, "purple": PURPLE}
"""Of methods, by name."""

# Most panels that are legible in one row.
_MOST_SIDE_BY_SIDE, _LEGEND_IN = 5, 0.4
_PANEL_SIZE = 7.5

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    # A fixed position: automatic placement would search for ticks at the top.
    "axes.titley": 1.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "legend.handlelength": 1.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
}


@contextmanager
def styled() -> Iterator[None]:
    """Apply the study's Matplotlib style within a context."""
    with mpl.rc_context():
        # Whatever a matplotlibrc of the user's says.
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def literal(text: str) -> str:
    """Return the name of a file so that its dollar signs set no mathematics; titles have none."""
    return text.replace("$", r"\$")


def figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure of the given size."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def row_of_panels(
    count: int, height_in: float, *, sharey: bool = False, stacked: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a page-wide figure with panels in one or more rows, or a narrow one of a column."""
    rows = count if stacked else -(-count // _MOST_SIDE_BY_SIDE)
    columns = -(-count // rows)
    drawn = figure(COLUMN_IN if stacked else PAGE_IN, rows * (height_in - _LEGEND_IN) + _LEGEND_IN)
    grid = list(drawn.subplots(rows, columns, sharey=sharey, squeeze=False).ravel())
    for axes in grid[count:]:
        axes.set_axis_off()
    return drawn, grid[:count]


def panel(axes: Axes, letter: str, title: str, most_letters: int = 34) -> None:
    """Label a panel, cutting a title that is too long."""
    short = title if len(title) <= most_letters else f"{title[: most_letters - 1]}…"
    place = axes.set_title(f"     {short}", fontsize=_PANEL_SIZE).get_transform()
    axes.text(0, 1, letter, transform=place, fontsize=_PANEL_SIZE, fontweight="bold")


def save(drawn: Figure, output: Path, *prints: Path) -> None:
    """Write a figure as PNG, and as PDF for print; without dates, so that both are reproducible."""
    with atomic_write(output) as scratch:
        scratch.write_bytes(png_of(drawn, 256))
    for file in prints:
        with atomic_write(file) as scratch:
            drawn.savefig(scratch, format="pdf", metadata={"CreationDate": None, "Creator": None})


def png_of(drawn: Figure, colours: int) -> bytes:
    """Return a figure as PNG of at most so many colours: it is half as large, or less."""
    png, few = BytesIO(), BytesIO()
    save_png(drawn, png)
    with PIL.Image.open(png) as image:
        flat = image.convert("RGB").quantize(colours, dither=PIL.Image.Dither.NONE)
        flat.save(few, "png", dpi=image.info["dpi"])
    return few.getvalue()


def save_png(drawn: Figure, output: Path | BinaryIO) -> None:
    """Write a figure as PNG, and fix its layout for other formats."""
    lay_out(drawn, mpl.rcParams["savefig.dpi"])
    drawn.savefig(output, format="png", metadata={"Software": None})


def lay_out(drawn: Figure, dots_per_inch: float) -> None:
    """Replace tick formatters and run the layout engine once.

    Otherwise each `savefig` would draw twice, and a second layout would differ.
    """
    for axis in (axis for axes in drawn.axes for axis in (axes.xaxis, axes.yaxis)):
        if type(usual := axis.get_major_formatter()) is LogFormatterSciNotation:
            axis.set_major_formatter(_Plain(labelOnlyBase=usual.labelOnlyBase))
        if type(usual := axis.get_minor_formatter()) is LogFormatterSciNotation:
            axis.set_minor_formatter(_Plain(labelOnlyBase=usual.labelOnlyBase))
    drawn.set_dpi(dots_per_inch)
    if (engine := drawn.get_layout_engine()) is not None:
        engine.execute(drawn)
    drawn.set_layout_engine(None)


_MATHTEXT_POWER = re.compile(r"\^\{(.*?)\}")


class _Plain(LogFormatterSciNotation):
    """Log formatter that writes plain text instead of math text."""

    def __call__(self, x: float, pos: Any = None) -> str:
        text: str = super().__call__(x, pos)
        plain = _MATHTEXT_POWER.sub(lambda power: power[1].translate(SUPERSCRIPTS), text)
        return re.sub(r"\$\\mathdefault\{(.*)\}\$", r"\1", plain).replace(r"\times", "×")


# Ratio of the longest to the shortest interval from which times are drawn on a logarithmic scale.
_SPARSER = 30.0


def is_over_decades(time_s: Array) -> bool:
    """Return True for times that are dense at first and sparse at last, after zero."""
    return bool(time_s[0] > 0 and np.max(np.diff(time_s)) > _SPARSER * np.min(np.diff(time_s)))
