"""Figures of the gripper, drawn from the committed study's settings and read back."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from biogrip.figures.mechanics import draw_linearisation
from biogrip.figures.style import styled
from biogrip.records.identifications import DIFFERENCES
from biogrip.stages.targets import compare
from tests.helpers.default import STUDY, seen, study_of

CASE = "liquid_drop_1"


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
