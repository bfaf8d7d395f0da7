"""Figures of the gripper, drawn from the committed study's settings and read back."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from biogrip.figures.gripper import draw_comb, draw_linkage, draw_torque
from biogrip.figures.mechanics import draw_linearisation
from biogrip.figures.style import styled
from biogrip.records.identifications import DIFFERENCES
from biogrip.stages.targets import compare
from biogrip.study.study import Study
from tests.helpers.default import STUDY, seen, study_of

CASE = "liquid_drop_1"


def drawn(draw: Callable[[Study], Figure]) -> Figure:
    """A figure of the default study's inputs."""
    with styled():
        return draw(STUDY)


def test_torque_shows_the_protocol_and_its_voltages() -> None:
    left, right = drawn(draw_torque).axes
    assert (left.get_ylabel(), right.get_ylabel()) == ("torque (nN m)", "voltage (V)")
    assert [text.get_text() for text in left.texts] == ["1.6 nN m", "0.32 nN m"]
    # 27 to 55 V to touch a sample, whose squares add up with those of the grip.
    volts = [text.get_text() for text in right.texts]
    assert volts == ["57.4 V", "55.6 V", "31.9 V", "28.4 V", "16.3 V", "7.28 V"]
    legend = right.get_legend()
    assert legend
    assert [t.get_text() for t in legend.get_texts()] == ["30 µm", "120 µm", "from contact"]


def test_comb_has_every_finger_where_it_is() -> None:
    whole, _, curve = drawn(draw_comb).axes
    floating, fixed = whole.collections
    assert len(floating.get_paths()) == len(fixed.get_paths()) == 66
    outermost = max(np.hypot(*np.asarray(p.vertices).T).max() for p in fixed.get_paths())
    # Outside the last finger is one more gap; arcs are splines, good to 2e-4.
    assert outermost == pytest.approx(321 + 66 * 14 - 3, rel=3e-4)
    assert curve.get_xlabel() == "voltage (V)"


def test_tips_are_drawn_as_far_closed_as_samples_let_them() -> None:
    """Enlarged, which is said, for 3 mrad would not be seen."""
    tips = drawn(draw_linkage).axes[1]
    legend = tips.get_legend()
    assert legend
    said = legend.get_texts()[1].get_text()
    told = re.fullmatch(r"closed by ([\d.]+) mrad \(drawn (\d+) times\)", said)
    assert told
    # The softest sample of the study gives way by 3.2 mrad.
    assert float(told[1]) == pytest.approx(3.2, abs=0.05)
    arms = [np.asarray(line.get_xydata()) for line in tips.lines if line.get_linewidth() == 2]
    left = [arm for arm in arms if len(arm) == 2 and arm[0, 0] < 0]
    before, after = (np.arctan2(*(arm[1] - arm[0])[::-1]) for arm in left)
    assert 1e3 * (before - after) == pytest.approx(float(told[1]) * int(told[2]), rel=0.02)


def test_each_case_is_compared_under_its_own_protocol_and_small_differences_are_yellow(
    tmp_path: Path,
) -> None:
    own = study_of(
        f"cases: {{{CASE}: {{protocol: {{phases: [{{duration_s: 10.0, torque_Nm: 0.8e-9}}]}}}}}}"
    )
    axes, differences = {}, {}
    for name, study in (("own", own), ("default", STUDY)):
        file = tmp_path / f"{name}.csv"
        few = seen(cases={CASE: study.cases[CASE]})
        compare(few, file)
        differences[name] = DIFFERENCES.read(file)["difference_over_peak"]
        with styled():
            axes[name] = draw_linearisation(few, file).axes
    assert not np.allclose(differences["own"], differences["default"], rtol=0.1)
    assert axes["own"][0].get_xlim()[1] == pytest.approx(10.0, rel=0.1)
    curve = np.abs(np.asarray(axes["default"][0].lines[0].get_ydata()))
    # At twenty times the torque the peak is tens of mrad, and the models differ by some percent.
    assert 0.01 < curve.max() < 5
    (mesh,) = (c for c in axes["default"][1].collections if isinstance(c, QuadMesh))
    assert mesh.get_cmap().name == "cividis_r"
