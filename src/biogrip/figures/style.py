"""Common style of all figures: legible at column width, safe for colour-blind readers."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import matplotlib as mpl
from fontTools import subset
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.figures.decades import label_plainly
from biogrip.files import atomic_write
from biogrip.fit.methods import Method

COLUMN_IN = 3.5
PAGE_IN = 7.2

# Okabe and Ito's palette.
BLACK, GREY = "#000000", "#999999"
BLUE, ORANGE, GREEN = "#0072B2", "#D55E00", "#009E73"
SKY, PURPLE = "#56B4E9", "#CC79A7"
SHADE = "#DCE6EE"

# Colours have the same meaning in all figures.
TARGET, MEASURED, FITTED, PAPER, ALL_SEEDS = BLACK, SKY, ORANGE, GREEN, GREY

COLORS = {
    "grey": GREY,
    "blue": BLUE,
    "vermilion": ORANGE,
    "green": GREEN,
    "sky": SKY,
    "purple": PURPLE,
    "amber": "#E69F00",
}
"""By the names that methods say them by (`biogrip.fit.methods`)."""

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


def line_of(method: Method) -> dict[str, Any]:
    """Style of a method's lines for Matplotlib."""
    return {"color": COLORS[method.color], "linestyle": method.dashes}


@contextmanager
def styled() -> Iterator[None]:
    """Apply the study's Matplotlib style within a context."""
    with mpl.rc_context(_STYLE):
        yield


def figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure of the given size."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def row_of_panels(
    count: int, height_in: float, *, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a page-wide figure with panels in one or more rows."""
    rows = -(-count // _MOST_SIDE_BY_SIDE)
    columns = -(-count // rows)
    drawn = figure(
        PAGE_IN, height_in if rows == 1 else rows * (height_in - _LEGEND_IN) + _LEGEND_IN
    )
    grid = list(drawn.subplots(rows, columns, sharey=sharey, squeeze=False).ravel())
    for axes in grid[count:]:
        axes.set_axis_off()
    return drawn, grid[:count]


def save(drawn: Figure, output: Path) -> None:
    """Write a figure as PNG and PDF, without dates, so that files are reproducible."""
    with atomic_write(output) as scratch:
        save_png(drawn, scratch)
    with atomic_write(output.with_suffix(".pdf")) as scratch, _glyphs_alone():
        drawn.savefig(scratch, format="pdf", metadata={"CreationDate": None, "Creator": None})


def save_png(drawn: Figure, output: Path | BinaryIO) -> None:
    """Write a figure as PNG, and fix its layout for other formats."""
    lay_out(drawn, mpl.rcParams["savefig.dpi"])
    drawn.savefig(output, format="png", metadata={"Software": None})


def lay_out(drawn: Figure, dots_per_inch: float) -> None:
    """Replace tick formatters and run the layout engine once.

    Otherwise each `savefig` would draw twice, and a second layout would differ.
    """
    label_plainly(drawn)
    drawn.set_dpi(dots_per_inch)
    if (engine := drawn.get_layout_engine()) is not None:
        engine.execute(drawn)
    drawn.set_layout_engine(None)


@contextmanager
def _glyphs_alone() -> Iterator[None]:
    """Make Matplotlib skip font tables that are for text layout, since a PDF has placed glyphs.

    Parsing and subsetting those tables would take a quarter of a figure's time.
    """
    before = subset.load_font

    def load_font(*given: Any, **options: Any) -> Any:
        font = before(*given, **options)
        for table in {"GDEF", "GPOS", "GSUB", "kern"} & set(font.keys()):
            del font[table]
        return font

    subset.load_font = load_font
    try:
        yield
    finally:
        subset.load_font = before


def panel(axes: Axes, letter: str, title: str, most_letters: int = 34) -> None:
    """Label a panel, cutting a title that is too long."""
    short = title if len(title) <= most_letters else f"{title[: most_letters - 1]}…"
    place = axes.set_title(f"     {short}", fontsize=_PANEL_SIZE).get_transform()
    axes.text(0, 1, letter, transform=place, fontsize=_PANEL_SIZE, fontweight="bold")
