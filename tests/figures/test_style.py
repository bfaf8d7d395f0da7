"""Files of figures, ticks, prefixes, colours, and what is beyond an axis."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.lines import Line2D

from biogrip.figures.fit import scale_of
from biogrip.figures.style import figure, line_of, literal, points_within, save, styled
from biogrip.fit.problem import METHODS
from tests.helpers.default import STUDY
from workflow.paper.gripper import draw_torque


def test_a_matplotlibrc_changes_no_figure(tmp_path: Path) -> None:
    theirs = tmp_path / "matplotlibrc"
    for name, content in (("a", ""), ("b", "text.color: red\nsavefig.facecolor: yellow\n")):
        theirs.write_text(content)
        with mpl.rc_context(fname=theirs), styled():
            save(draw_torque(STUDY), tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_figure_for_print_has_fonts_that_publishers_take(tmp_path: Path) -> None:
    with styled():
        save(draw_torque(STUDY), tmp_path / "torque.png", tmp_path / "torque.pdf")
    content = (tmp_path / "torque.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert b"/CIDFontType2" in content
    assert b"/Type3" not in content


@pytest.mark.parametrize("title", [r"$\frac{$", "5$ a day, 10$ a week", r"a_b ^ \ % # & < {"])
def test_a_title_sets_no_mathematics(tmp_path: Path, title: str) -> None:
    with styled():
        for name, text, parsed in (("a", literal(title), True), ("b", title, False)):
            drawn = figure(3, 2)
            drawn.suptitle(text, parse_math=parsed)
            save(drawn, tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("value", "expected"),
    [(2.0, (1.0, "rad")), (3e-3, (1e3, "mrad")), (3e-5, (1e6, "µrad")), (3e-8, (1e9, "nrad"))],
)
def test_prefixes(value: float, expected: tuple[float, str]) -> None:
    assert scale_of(np.array([-value, 0.0]), "rad") == expected


def test_every_method_is_drawn_as_no_other() -> None:
    lines = [tuple(line_of(method).values()) for method in METHODS.values()]
    assert len(set(lines)) == len(lines)
    for method in METHODS.values():
        Line2D([], [], **line_of(method))


def test_points_beyond_an_axis_are_triangles_at_its_edge() -> None:
    axes = figure(3, 3).subplots()
    points = np.array([[1.0, 0.5], [2.0, 2.0], [3.0, -7.0], [4.0, 7.0], [99.0, 2.0]])
    points_within(axes, points, (0, 0), (9, 5), {"marker": "o"}, edge_size=3)
    drawn_at = {line.get_marker(): np.asarray(line.get_xydata()) for line in axes.lines}
    np.testing.assert_array_equal(drawn_at["o"], points[:2])
    edges = {"v": [[3, 0]], "^": [[4, 5]], ">": [[9, 2]]}
    assert {marker: at.tolist() for marker, at in drawn_at.items() if marker != "o"} == edges
