"""Every figure, drawn from a small study, is what it was: compared with pictures kept here.

``make pinned`` draws the pictures anew. Look at what has changed before you commit them.
"""

from collections.abc import Callable
from itertools import product as all_pairs
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from PIL import Image

from biogrip.arrays import Array
from biogrip.figures import declared
from biogrip.figures import robustness as heat_map
from biogrip.figures.style import lay_out, styled
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.stages.sweep_points import POINTS
from biogrip.tables.heat_maps import heat_maps
from tests.helpers.default import plan_of, study_of
from tests.helpers.runs import SMALL

PINNED = Path(__file__).with_name("pinned")
# Small pictures, in which a line is still a line.
DPI = 60
# Root mean square of the difference of all pixels, of 255. Results are the same bytes on every
# processor; what is left to it are last bits of coordinates, of which antialiasing makes
# differences of a level or two in a few pixels: some 0.01. A thin line in another colour makes
# 0.7 or more in every figure, which the tests below show.
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

Draw = Callable[[str], Figure]


def jobs() -> dict[str, tuple[str, dict[str, str]]]:
    """Figure and wildcards of every picture of the small study, by the picture's name."""
    plan = plan_of(SMALL)
    return {
        Path(figure.writes["png"].format(**job)).stem: (figure.name, dict(job))
        for figure in products().values()
        if figure.category == "Figures"
        for job in figure.jobs(plan)
    }


JOBS = jobs()
HEAT_MAPS = "robustness_level"
# Those of overlays, by what they are drawn from here.
OTHERS = {
    HEAT_MAPS: "robustness_figure",
}
NAMES = [*JOBS, *OTHERS]
EACH = pytest.mark.parametrize(
    ("name", "figure"), [(name, name) for name in NAMES], indirect=["figure"], ids=NAMES
)


@pytest.fixture(scope="module")
def draw(finished: Path) -> Draw:
    """Draw a figure by the name of its picture; a figure that was drawn may be changed."""

    def drawn(name: str) -> Figure:
        figures: list[Figure] = []
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(finished)
            patch.setattr(declared, "save", lambda figure, _: figures.append(figure))
            figure, job = JOBS[name]
            products()[figure].run(Plan(study_of(SMALL), Path("results")), job)
        return figures[0]

    return drawn


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Points of a sweep, of all sizes of numbers and without a bound here and there."""
    folder = tmp_path_factory.mktemp("points")
    sweep = study_of(SWEEP).sweeps["level"]
    files = []
    for n, case in enumerate(sweep.cases):
        rows = []
        grid = list(all_pairs(sweep.rows.levels, sweep.columns.levels))
        for i, (row, column) in enumerate(grid):
            for j, method in enumerate(("genetic", "least_squares")):
                for q, quantity in enumerate(("k", "k_p", "c", "c_p", "c + c_p")):
                    share = ((3 * i + 2 * j + n) % 11) / 10
                    error = 0.004 * 7.0 ** (i + q)
                    bound = np.nan if row.text == "0" else error * 2.0 ** (i - 3)
                    values = (row.text, column.text, method, quantity, 20, share, error, bound)
                    rows.append((f"{case}-{i}", *values))
        files.append(folder / f"{case}.csv")
        POINTS.write(files[-1], rows)
    return files


def picture(figure: Figure) -> Array:
    """What is seen of a figure, as (height, width, 3) from 0 to 255."""
    with styled():
        canvas: Any = FigureCanvasAgg(figure)
        lay_out(figure, DPI)
        canvas.draw()
        return np.array(canvas.buffer_rgba())[..., :3].astype(float)


def kept(path: Path, found: Array) -> None:
    Image.fromarray(found.astype(np.uint8)).save(path)


def difference(name: str, found: Array) -> float:
    """Root mean square by which a picture differs from the pinned one."""
    pinned = 255 * imread(PINNED / f"{name}.png")[..., :3].astype(float)
    return float(np.sqrt(np.mean((found - pinned) ** 2))) if found.shape == pinned.shape else np.inf


@pytest.fixture(scope="module")
def figure(
    request: pytest.FixtureRequest,
    draw: Draw,
    judged: list[Path],
    tmp_path_factory: pytest.TempPathFactory,
) -> Figure:
    """The figure that two tests are about, drawn; the second changes it."""
    if request.param not in OTHERS:
        return draw(request.param)
    with styled():
        return heat_map.draw(heat_maps(study_of(SWEEP), {"sweep": "level"}), judged)


@pytest.fixture
def comparable(pinning: bool) -> None:
    if not pinning and VERSION_FILE.read_text().strip() != VERSION:
        pytest.skip(f"pictures are pinned with Matplotlib {VERSION_FILE.read_text().strip()}")


@pytest.mark.usefixtures("comparable")
@EACH
def test_a_figure_is_what_it_was(name: str, figure: Figure, tmp_path: Path, pinning: bool) -> None:
    """If the change is meant: make pinned."""
    found = picture(figure)
    if pinning:
        PINNED.mkdir(exist_ok=True)
        kept(PINNED / f"{name}.png", found)
    by = difference(name, found)
    if by >= TOLERANCE:
        kept(tmp_path / f"{name}.png", found)
    assert by < TOLERANCE, f"see {tmp_path}"


@pytest.mark.usefixtures("comparable")
@EACH
@pytest.mark.nightly
def test_a_change_of_drawing_is_seen(name: str, figure: Figure) -> None:
    """A line's colour, or where it is by a fiftieth of the axis; or else a number or a bar."""
    lines = [
        (axes, line)
        for axes in figure.axes
        for line in axes.lines
        if len(np.atleast_1d(line.get_xdata())) and line.get_visible()
    ]
    if not lines:
        if figure.axes[0].texts:
            figure.axes[0].texts[-1].set_text("8")
        else:
            figure.axes[0].patches[-1].set_facecolor("#8B4513")
        assert difference(name, picture(figure)) > TOLERANCE
        return
    axes, line = lines[-1]
    colour = line.get_color()
    line.set_color("#8B4513")
    assert difference(name, picture(figure)) > TOLERANCE
    line.set_color(colour)
    to_points = axes.transScale + axes.transLimits
    places = to_points.transform(line.get_xydata()) + 0.02
    line.set_data(*to_points.inverted().transform(places).T)
    assert difference(name, picture(figure)) > TOLERANCE


def test_every_figure_is_pinned_and_nothing_else(pinning: bool) -> None:
    if pinning:
        VERSION_FILE.write_text(f"{VERSION}\n")
        for path in PINNED.glob("*.png"):
            if path.stem not in NAMES:
                path.unlink()
    assert {path.stem for path in PINNED.glob("*.png")} == set(NAMES)
    pinned = {JOBS[name][0] for name in JOBS} | set(OTHERS.values())
    assert pinned == {name for name, one in products().items() if one.category == "Figures"}
    assert sum(path.stat().st_size for path in PINNED.iterdir()) < 1_000_000
