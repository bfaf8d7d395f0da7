from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from biogrip.figures import style
from biogrip.figures.fit import FittedTrace, draw_fit, scale_of
from biogrip.figures.likelihood import draw_profile, draw_profiles_of
from biogrip.figures.style import figure, save, styled
from biogrip.physics.instruments import MODULUS
from biogrip.physics.models import MODELS
from biogrip_study.figures.case_fit import draw_fits
from biogrip_study.figures.course import draw_convergence
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.rows import write_arrays
from biogrip_study.records.traces import Measurements, write_measurements
from tests.helpers.default import STUDY, study_of
from tests.helpers.problems import rotation
from workflow.paper.gripper import draw_torque

CASE = "liquid_drop_2"
TRUTH = [1.0, 1e-4, 10.0, 1e-3]
TIME_S = np.arange(0.0, 400.5, 1.0)
FEW = "seeds: 3\nmethods: [genetic]\n"
MODEL = MODELS["generalized_maxwell"]


def identified(folder: Path, method: str = "genetic", case: str = "x", **own: Any) -> Path:
    frame = pd.DataFrame(own).assign(case=case, method=method, evaluations=1, stop_reason=1)
    ones = *(p.column for p in MODEL.parameters), "misfit", "noise_rms"
    alike: dict[str, Any] = dict.fromkeys(ones, 1.0)
    alike |= {"seed": range(len(frame)), "generations": 1}
    frame = frame.assign(**{name: it for name, it in alike.items() if name not in own})
    frame.to_csv(folder / f"{case}.csv", index=False)
    return folder / f"{case}.csv"


@pytest.fixture
def identifications(tmp_path: Path) -> Path:
    """Of the seeds 1 and 2 near the noise, and 0 above it."""
    known: dict[str, Any] = dict(zip((p.column for p in MODEL.parameters), TRUTH, strict=True))
    known |= {"k_N_per_m": [9.0, 0.7, 1e-6], "misfit": [1.3e-4, 5.05e-5, 3e-5]}
    return identified(tmp_path, case=CASE, **known, noise_rms=[1e-4, 5e-5, 3e-5])


def test_the_first_run_of_each_basin_is_drawn(tmp_path: Path, identifications: Path) -> None:
    target, rng = rotation(MODEL, TRUTH, TIME_S), np.random.default_rng(0)
    traces = {seed: target + 1e-4 * rng.standard_normal(len(TIME_S)) for seed in range(3)}
    measured = tmp_path / "seeds_0-2.npz"
    write_measurements(measured, Measurements(TIME_S, target, traces))
    with styled():
        drawn = draw_fits(study_of(FEW).cases[CASE], identifications, [measured])
    for label, k in (("seed 1, near the noise", 0.7), ("seed 0, above the noise", 9.0)):
        expected = 1e3 * rotation(MODEL, [k, *TRUTH[1:]], TIME_S)
        (line,) = (it for it in drawn.axes[0].lines if label in str(it.get_label()))
        np.testing.assert_allclose(np.asarray(line.get_ydata(), float), expected, rtol=1e-9)
    left = np.asarray(drawn.axes[1].lines[2].get_ydata(), dtype=float)
    apart = target - rotation(MODEL, [9.0, *TRUTH[1:]], TIME_S)
    np.testing.assert_allclose(left, 1e3 * apart)
    low, high = drawn.axes[0].get_ylim()
    assert low <= -0.6 < 4.2 <= high


def test_axes_suit_the_sampling_and_residuals_are_in_the_unit_that_was_minimised() -> None:
    dense, decades = np.linspace(0.0, 10.0, 200), np.geomspace(0.01, 1000.0, 200)
    for time_s, sd, scale, unit in (
        *((decades, None, "log", " (Pa)"), (dense, None, "linear", " (Pa)")),
        (dense, np.full(200, 0.5), "linear", " / sd"),
    ):
        modulus = 100 / (1 + time_s)
        fit = FittedTrace(time_s, None, 1.01 * modulus, modulus, sd, MODULUS)
        traces, residuals = draw_fit({"fit": fit}, "").axes
        assert (traces.get_xscale(), traces.get_yscale()) == (scale, scale)
        assert traces.get_ylabel() == "modulus (Pa)"
        assert (residuals.get_yscale(), residuals.get_ylabel()) == ("linear", f"residual{unit}")
        points = np.asarray(residuals.lines[0].get_ydata(), dtype=float)
        np.testing.assert_allclose(points, 0.01 * modulus / (1 if sd is None else sd))


def test_no_more_seeds_are_drawn_than_can_be_seen(tmp_path: Path) -> None:
    few, many = (50, 7, 48, "all 50 seeds"), (1500, 1000, 99, "first 100 of 1500 seeds")
    for seeds, above, others, label in (few, many):
        numbers = np.arange(seeds)
        misfit = np.where(numbers < above, 1.0, 1.5)
        found = identified(tmp_path, case=CASE, misfit=misfit)
        history = {"seed": np.tile(numbers, 4), "generation": np.repeat([0, 1, 0, 1], seeds)}
        history["best_misfit"] = np.tile(misfit, 4)
        history["method"] = np.repeat(["genetic", "least_squares"], 2 * seeds)
        write_arrays(tmp_path / "history.npz", history)
        case = study_of(f"seeds: {seeds}\nmethods: [genetic]").cases[CASE]
        drawn = draw_convergence(case, found, tmp_path / "history.npz")
        (axes,), (legend,) = drawn.axes, drawn.legends
        colors = [line.get_color() for line in axes.lines if len(np.asarray(line.get_xdata()))]
        assert [colors.count(each) for each in (style.ALL_SEEDS, *style.RUNS)] == [others, 1, 1]
        assert legend.get_texts()[0].get_text() == label


def test_a_set_in_two_parts_is_shaded_in_two_parts() -> None:
    """Of a quantity whose profile is a parabola of its logarithm around 2, with few points."""
    logs = np.linspace(-1, 1, 9)
    profile = {"values": list(2 * np.exp(logs)), "increases": list((4 * logs) ** 2)}
    item = {"symbol": "$k$", "unit": "N/m", "low": 1.2, "high": 3.3, "excluded": [[1.9, 2.1]]}
    axes = figure(3, 3).subplots()
    draw_profile(axes, {**item, "profile": profile})
    spans = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    edges = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in spans]
    assert edges == [(1.2, 1.9), (2.1, pytest.approx(3.3))]


def test_a_figure_for_print_has_fonts_that_publishers_take(tmp_path: Path) -> None:
    with styled():
        save(draw_torque(STUDY), tmp_path / "torque.png", tmp_path / "torque.pdf")
    content = (tmp_path / "torque.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert b"/CIDFontType2" in content
    assert b"/Type3" not in content


def test_prefixes_dollars_and_methods() -> None:
    scales = {2.0: (1.0, "rad"), 3e-3: (1e3, "mrad"), 3e-5: (1e6, "µrad"), 3e-8: (1e9, "nrad")}
    assert {value: scale_of(np.array([-value, 0.0]), "rad") for value in scales} == scales
    assert style.literal("5$ a day") == r"5\$ a day"
    assert len({it.color for it in METHODS.values()}) == len(METHODS)
    assert [it.dashes for it in METHODS.values()] == ["-", "--"]


@pytest.mark.parametrize(("certainty", "drawn"), [(10.8, True), (14.0, False)])
def test_the_legend_of_profiles_names_what_is_drawn(certainty: float, *, drawn: bool) -> None:
    values = np.geomspace(0.5, 2.0, 41)
    profile = {"values": values.tolist(), "increases": (30 * np.log(values) ** 2).tolist()}
    ends = {"low": 0.7, "high": 1.4, "excluded": [], "verdict": "determined"}
    item = {"quantity": "k", "symbol": "k", "unit": "Pa", "profile": profile, **ends}
    judged = {"quantities": [item] * 3, "threshold": 3.84, "confidence": 0.95}
    for stacked in (False, True):
        found = draw_profiles_of({**judged, "certainty": certainty}, stacked=stacked)
        said = [text.get_text() for text in found.legends[0].get_texts()]
        assert "95 %: limits" in said
        assert ("99.9 %: needed to close a side" in said) == drawn
        rows = {axes.get_position().y0 for axes in found.axes}
        assert len(rows) == (3 if stacked else 1)
