"""Every figure of a small study is what ``make pinned`` has kept here: look at what changes."""

from io import BytesIO
from itertools import product as all_pairs
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

from biogrip.figures.style import save_png, styled
from biogrip_study.figures.overview import draw_robustness
from biogrip_study.tables.sweeps import POINTS
from tests.helpers.default import study_of

PINNED = Path(__file__).with_name("pinned")
# Size as a share of what is drawn, and colours, in which a line is still a line.
SIZE, COLOURS = 0.25, 128
# Root mean square of the difference of all pixels, of 255. Last bits of coordinates, which are left
# to the processor, make some 0.01 by antialiasing; a line in another colour makes more.
TOLERANCE = 0.2
# Text is set differently by another minor version of Matplotlib, which brings another FreeType.
VERSION = ".".join(mpl.__version__.split(".")[:2])
VERSION_FILE = PINNED / "matplotlib-version"
SWEEP = """
methods: [genetic, least_squares]
sweeps:
  level:
    title: Level and rate
    cases: [endothelial_cell, liquid_drop_1, liquid_drop_2]
    rows: {label: level, unit: "%", unit_in_si: 0.01, key: measurement.noise.level,
           values: [0, 0.05, 0.2]}
    columns: {label: rate, unit: Hz, key: measurement.rate_Hz, values: [0.1, 10]}
"""


def judged(folder: Path) -> Path:
    """Points of a sweep, of all sizes of numbers and without a bound here and there."""
    sweep = study_of(SWEEP).config.sweeps["level"]
    grid = all_pairs(sweep.rows.levels, sweep.columns.levels)
    quantities = ("k", "k_p", "c", "c_p", "c + c_p")
    axes: Any = map(enumerate, (sweep.cases, grid, ("genetic", "least_squares"), quantities))
    rows = []
    for (n, case), (i, (row, column)), (j, method), (q, quantity) in all_pairs(*axes):
        share, error = ((3 * i + 2 * j + n) % 11) / 10, 0.004 * 7.0 ** (i + q)
        bound = np.nan if row.shown == "0" else error * 2.0 ** (i - 3)
        levels = (row.shown, column.shown, method, quantity)
        values = (20, share, share / 2, error, error / 2, bound)
        rows.append((f"{case}--level--{i}", *levels, *values))
    POINTS.write(folder / "level.csv", rows)
    return folder / "level.csv"


def reduced(file: Any) -> Image.Image:
    picture = Image.open(file).convert("RGB")
    width, height = (round(SIZE * pixels) for pixels in picture.size)
    return picture.resize((width, height), Image.Resampling.BOX)


def in_colours_of(palette: list[int], picture: Image.Image) -> Image.Image:
    colours = np.reshape(palette, (-1, 3))
    nearest = KDTree(colours).query(np.asarray(picture))[1]
    found = Image.fromarray(nearest.astype(np.uint8), "P")
    found.putpalette(palette)
    return found


def difference(name: str, found: Image.Image) -> float:
    """Root mean square by which a picture differs from the pinned one, in the latter's colours."""
    with Image.open(PINNED / f"{name}.png") as pinned:
        palette = pinned.getpalette()
        assert palette is not None
        if pinned.size != found.size:
            return np.inf
        both = pinned, in_colours_of(palette, found)
        before, now = (np.asarray(each.convert("RGB"), float) for each in both)
    return float(np.sqrt(np.mean((before - now) ** 2)))


def test_no_figure_changed(tiny: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """Of a recorded trace, `mine`, are only figures that a simulated one has, too."""
    pinning = request.config.getoption("--pin")
    if not pinning and VERSION_FILE.read_text().strip() != VERSION:
        pytest.skip(f"pictures are pinned with Matplotlib {VERSION_FILE.read_text().strip()}")
    with styled():
        save_png(draw_robustness(study_of(SWEEP), "level", judged(tmp_path)), drawn := BytesIO())
    files = {path.stem: path for path in (tiny / "results" / "figures").glob("*.png")}
    pictures = {name: reduced(it) for name, it in files.items() if not name.endswith("_mine")}
    pictures["robustness_level"] = reduced(drawn)
    if pinning:
        VERSION_FILE.write_text(f"{VERSION}\n")
        for path in PINNED.glob("*.png"):
            path.unlink()
        for name, picture in pictures.items():
            palette = picture.quantize(COLOURS).getpalette()
            assert palette is not None
            in_colours_of(palette, picture).save(PINNED / f"{name}.png", optimize=True)
    assert {path.stem for path in PINNED.glob("*.png")} == set(pictures)
    changed = [name for name, own in pictures.items() if difference(name, own) >= TOLERANCE]
    for name in changed:
        pictures[name].save(tmp_path / f"{name}.png")
    assert not changed, f"see {tmp_path}; if the change is meant: make pinned"
