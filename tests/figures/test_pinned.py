"""Every figure of a small study is what ``make pinned`` has kept here: look at what changes."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

PINNED = Path(__file__).with_name("pinned")
# Size as a share of what is drawn, and colours, in which a line is still a line.
SIZE, COLOURS = 0.25, 128
# Root mean square of the difference of all pixels, of 255. Last bits of coordinates, which are left
# to the processor, make some 0.01 by antialiasing; a line in another colour makes more.
TOLERANCE = 0.2
# Text is set differently by another minor version of Matplotlib, which brings another FreeType.
VERSION = ".".join(mpl.__version__.split(".")[:2])
VERSION_FILE = PINNED / "matplotlib-version"


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
    files = {path.stem: path for path in (tiny / "results" / "figures").glob("*.png")}
    pictures = {name: reduced(it) for name, it in files.items() if not name.endswith("_mine")}
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
