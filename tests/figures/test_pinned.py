"""Every figure of a small study is what it was: compared with pictures kept here.

``make pinned`` keeps the pictures of today. Look at what has changed before you commit them.
"""

from io import BytesIO
from itertools import product as all_pairs
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

from biogrip.figures.robustness import draw_robustness
from biogrip.figures.style import COLORS, save_png, styled
from biogrip.stages.sweeps import POINTS
from tests.helpers.default import study_of

PINNED = Path(__file__).with_name("pinned")
# Small pictures in few colours, in which a line is still a line: their size as a share of what is
# drawn.
SIZE, COLOURS = 0.25, 128
# Root mean square of the difference of all pixels, of 255. Results are the same bytes on every
# processor; what is left to it are last bits of coordinates, of which antialiasing makes
# differences of a level or two in a few pixels: some 0.01. A line in another colour makes more,
# which a test below shows.
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
HEAT_MAPS = "robustness_level"
# Of a recorded trace are only figures that a simulated one has, too.
RECORDED = "_mine"


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Points of a sweep, of all sizes of numbers and without a bound here and there."""
    folder = tmp_path_factory.mktemp("points")
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


@pytest.fixture(scope="module")
def pictures(tiny: Path, judged: Path) -> dict[str, Image.Image]:
    files = sorted((tiny / "results" / "figures").glob("*.png"))
    drawn = BytesIO()
    with styled():
        save_png(draw_robustness(study_of(SWEEP), "level", judged), drawn)
    found = {path.stem: path for path in files if not path.stem.endswith(RECORDED)}
    return {name: Image.open(file).convert("RGB") for name, file in found.items()} | {
        HEAT_MAPS: Image.open(drawn).convert("RGB")
    }


def reduced(picture: Image.Image) -> Image.Image:
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


@pytest.fixture
def comparable(pinning: bool) -> None:
    if not pinning and VERSION_FILE.read_text().strip() != VERSION:
        pytest.skip(f"pictures are pinned with Matplotlib {VERSION_FILE.read_text().strip()}")


@pytest.mark.usefixtures("comparable")
def test_no_figure_changed(pictures: dict[str, Image.Image], tmp_path: Path, pinning: bool) -> None:
    """If the change is meant: make pinned."""
    if pinning:
        VERSION_FILE.write_text(f"{VERSION}\n")
        for path in PINNED.glob("*.png"):
            path.unlink()
        for name, picture in pictures.items():
            palette = reduced(picture).quantize(COLOURS).getpalette()
            assert palette is not None
            kept = in_colours_of(palette, reduced(picture))
            kept.save(PINNED / f"{name}.png", optimize=True)
    assert {path.stem for path in PINNED.glob("*.png")} == set(pictures)
    by = {name: difference(name, reduced(picture)) for name, picture in pictures.items()}
    changed = {name: value for name, value in by.items() if value >= TOLERANCE}
    for name in changed:
        reduced(pictures[name]).save(tmp_path / f"{name}.png")
    assert not changed, f"see {tmp_path}"


@pytest.mark.usefixtures("comparable")
def test_a_line_in_another_colour_is_seen(pictures: dict[str, Image.Image]) -> None:
    """Of the colours in a picture, the one of the fewest pixels."""
    seen = []
    for name, picture in pictures.items():
        pixels = np.array(picture)
        codes = pixels @ np.array([65536, 256, 1])
        areas = [codes == int(code[1:], 16) for code in COLORS.values()]
        areas = [area for area in areas if area.sum() > 150]
        if areas:
            pixels[min(areas, key=np.sum)] = (139, 69, 19)
            assert difference(name, reduced(Image.fromarray(pixels))) > TOLERANCE, name
            seen.append(name)
    assert len(seen) > 0.7 * len(pictures)
