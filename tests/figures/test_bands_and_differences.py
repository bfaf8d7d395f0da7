"""What is drawn of bounds and differences: nothing where it would mislead."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from biogrip.figures import linearisation, scatter
from biogrip.figures.style import styled
from biogrip.physics.simulation import simulated_rotation
from biogrip.records.identifications import DIFFERENCES
from biogrip.records.traces import write_target
from biogrip.stages import model_difference
from tests.helpers.default import STUDY, seen, study_of

CASE = "liquid_drop_1"


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Any]:
    """Of drop 1: a target, three identifications, and that only the sum is determined."""
    case = STUDY.cases[CASE]
    problem = case.problem
    time_s = np.arange(0.0, 400.5, 1.0)
    network = problem.model.network(np.array([list(case.parameters.values())]))
    rotation = simulated_rotation(
        problem.gripper, network, problem.torque, time_s, nonlinear=False
    )[0]
    nothing = np.zeros_like(time_s)
    write_target(tmp_path / "target.csv", time_s, nothing, rotation, nothing)
    names = ["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"]
    head = ["case", "method", "seed", *names, "misfit", "noise_rms", "generations"]
    rows = [
        [CASE, "genetic", seed, k, 1e-4, 9.9, 0.1, 1e-4, 1e-4, 7, 100, "stalled"]
        for seed, k in enumerate((9.0, 1e-6, 10.0))
    ]
    frame = pd.DataFrame(rows, columns=[*head, "evaluations", "stop_reason"])
    frame.to_csv(tmp_path / "found.csv", index=False)
    verdicts = dict.fromkeys(["k", "k_p", "c", "c_p"], "not determined")
    verdicts["c + c_p"] = "determined"
    items = [{"quantity": name, "verdict": verdict} for name, verdict in verdicts.items()]
    content = {"quantities": items, "trades": [], "notes": []}
    (tmp_path / "expected.json").write_text(json.dumps(content))
    return {
        "identifications": tmp_path / "found.csv",
        "target": tmp_path / "target.csv",
        "expected": tmp_path / "expected.json",
        "calibrated": [],
    }


def drawn(study_overlay: str, files: dict[str, Any]) -> Figure:
    study = study_of(study_overlay)
    with styled():
        return scatter.draw(study.cases[CASE], **files)


def test_no_band_is_drawn_of_what_is_not_determined(files: dict[str, Any]) -> None:
    figure = drawn("", files)
    shaded = [any(isinstance(p, Rectangle) for p in axes.patches) for axes in figure.axes]
    assert shaded == [False] * 4 + [True]
    titles = [axes.get_title("left") for axes in figure.axes]
    assert "not determined" in titles[2]
    assert titles[4].endswith("%")
    assert figure.axes[2].get_yscale() == "log"
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert "beyond the axis" in texts
    assert any(text.startswith("95 % by the Cramér-Rao bound") for text in texts)
    assert any(text.endswith("rest known") for text in texts)
    # 1e-6 of 9.5 is below four decades: one triangle on the edge.
    triangles = [line for line in figure.axes[0].lines if line.get_marker() == "v"]
    assert sum(len(np.asarray(line.get_xdata())) for line in triangles) == 1


def test_the_band_has_the_confidence_of_the_study(files: dict[str, Any]) -> None:
    heights = []
    for overlay in ("", "identifiability: {confidence: 0.6827}"):
        (band,) = drawn(overlay, files).axes[4].patches
        heights.append(float(band.get_extents().height))
    assert heights[0] / heights[1] == pytest.approx(1.96, rel=1e-3)


def test_each_case_is_compared_under_its_own_protocol(tmp_path: Path) -> None:
    own = "protocol: {phases: [{duration_s: 10.0, torque_Nm: 0.8e-9}]}"
    study = study_of(f"cases: {{{CASE}: {{{own}}}}}")
    protocols = {name: case.phases for name, case in study.cases.items()}
    assert len(protocols[CASE]) == 1
    assert len(protocols["liquid_drop_2"]) == 2
    few = seen(cases={CASE: study.cases[CASE]})
    model_difference.compare(few, tmp_path / "own.csv")
    model_difference.compare(seen(cases={CASE: STUDY.cases[CASE]}), tmp_path / "study.csv")
    ours, theirs = (DIFFERENCES.read(tmp_path / f"{name}.csv") for name in ("own", "study"))
    assert not np.allclose(ours["difference_over_peak"], theirs["difference_over_peak"], rtol=0.1)
    with styled():
        figure = linearisation.draw(few, tmp_path / "own.csv")
    assert figure.axes[0].get_xlim()[1] == pytest.approx(10.0, rel=0.1)


def test_the_difference_of_the_models_is_drawn_and_small_is_yellow(tmp_path: Path) -> None:
    few = seen(cases={CASE: STUDY.cases[CASE]})
    model_difference.compare(few, tmp_path / "d.csv")
    with styled():
        figure = linearisation.draw(few, tmp_path / "d.csv")
    curve = np.abs(np.asarray(figure.axes[0].lines[0].get_ydata()))
    # At twenty times the torque the peak is tens of mrad, and the models differ by some percent.
    assert 0.01 < curve.max() < 5
    (mesh,) = (c for c in figure.axes[1].collections if isinstance(c, QuadMesh))
    assert mesh.get_cmap().name == "cividis_r"
