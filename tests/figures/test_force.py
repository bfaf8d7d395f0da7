from pathlib import Path

import pytest
from matplotlib.figure import Figure

from biogrip.figures import force
from biogrip.figures.style import styled
from biogrip.stages import targets as target
from tests.helpers.default import study_of

STUDY = study_of(
    """
    measurement: {rate_Hz: 1.0}
    cases:
      left: {contact: unilateral, sample: {model: kelvin_voigt, k_p: 0.05, c_p: 5.0}}
      bent:
        sample: {model: liquid_drop, k: 1.0, k_p: 1.0e-3, c: 10.0}
        models: {target: nonlinear}
    """
)


def drawn(name: str, tmp_path: Path) -> Figure:
    file = tmp_path / f"{name}.csv"
    target.simulate(STUDY.cases[name], file)
    with styled():
        return force.draw(STUDY.cases[name], file)


def labels(figure: Figure) -> list[list[str]]:
    legends = [axes.get_legend() for axes in figure.axes]
    return [[text.get_text() for text in legend.get_texts()] for legend in legends if legend]


@pytest.mark.parametrize(
    ("name", "pulls", "free"),
    [
        ("endothelial_cell", False, False),
        ("liquid_drop_1", True, True),
        ("left", True, True),
        ("bent", True, False),
    ],
)
def test_a_pull_is_marked(tmp_path: Path, name: str, pulls: bool, free: bool) -> None:
    forces, rotations = labels(drawn(name, tmp_path))
    assert ("the jaws would have to pull" in forces) == pulls
    assert ("jaws that let go" in forces) == free
    assert ("jaws that let go" in rotations) == (free and name != "left")
