"""Profiles and valleys as they are drawn, read back from their axes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from biogrip.products.figures import overview, profiles, valley
from biogrip.products.figures.decades import decade_ticks
from biogrip.products.figures.style import figure, styled

BEST = 2.0


def item(**changes: Any) -> dict[str, Any]:
    """A quantity whose profile is a parabola of its logarithm, with few points."""
    values = BEST * np.exp(np.linspace(-1, 1, 9))
    profile = {"values": list(values), "rises": list((4 * np.log(values / BEST)) ** 2)}
    limits = {"low": BEST * np.exp(-0.49), "high": BEST * np.exp(0.49), "excluded": []}
    words = {"quantity": "k", "symbol": "$k$", "unit": "N/m", "verdict": "determined"}
    return {**words, **limits, "profile": profile, **changes}


def written(path: Path, *items: dict[str, Any]) -> Path:
    content = {"quantities": list(items), "trades": [], "notes": []}
    levels = {"confidence": 0.9, "threshold": 2.71, "certainty": 10.83}
    path.write_text(json.dumps({**content, **levels}))
    return path


def drawn(path: Path) -> Any:
    with styled():
        return profiles.draw(profiles.Settings("A drop", {"k": 2.2}), path, [])


def test_a_profile_is_a_curve_and_crosses_its_threshold_at_its_limits(tmp_path: Path) -> None:
    axes = drawn(written(tmp_path / "v.json", item())).axes[0]
    (curve,) = (line for line in axes.lines if line.get_label() == "this trace")
    values, rises = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    assert len(values) > 40
    # Its root is bent at the optimum only, where cubics round it off.
    away = np.abs(np.log(values / BEST)) > 0.3
    np.testing.assert_allclose(
        rises[away], (4 * np.log(values[away] / BEST)) ** 2, rtol=0.05, atol=0.05
    )
    low, high = axes.get_xlim()
    assert low < BEST * np.exp(-0.49)
    assert high > BEST * np.exp(0.49)


def test_both_thresholds_are_drawn_and_named(tmp_path: Path) -> None:
    made = drawn(written(tmp_path / "v.json", item()))
    flat = {float(line.get_ydata()[0]) for line in made.axes[0].lines if line.get_xdata()[0] == 0}
    assert {2.71, 10.83} <= flat
    texts = [text.get_text() for text in made.legends[0].get_texts()]
    assert "90 %" in texts
    assert any(text.startswith("99.9 %") for text in texts)


def test_a_set_in_two_parts_is_shaded_in_two_parts(tmp_path: Path) -> None:
    made = drawn(written(tmp_path / "v.json", item(excluded=[[1.9, 2.1]])))
    spans = [patch for patch in made.axes[0].patches if isinstance(patch, Rectangle)]
    edges = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in spans]
    assert [round(end, 3) for pair in edges for end in pair] == [1.225, 1.9, 2.1, 3.265]


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (1e-3, 1e7, ["10⁻³", "10²", "10⁷"]),
        (0.5, 50, ["10⁰", "10¹"]),
        (1.5e-4, 1.2e-3, ["0.0002", "0.001"]),
        (2.1, 4.9, []),
    ],
)
def test_ticks_do_not_collide(low: float, high: float, labels: list[str]) -> None:
    ticks, found = decade_ticks(low, high)
    assert found == labels
    assert all(low <= tick <= high for tick in ticks)


def test_fits_beyond_a_valleys_axes_are_marked(tmp_path: Path) -> None:
    shares = np.linspace(0.1, 0.9, 5)
    sums = 10 * np.array([[0.9], [1.0], [1.1]])
    rises = np.tile([[50.0], [0.0], [60.0]], (1, 5))
    grid = {"x_values": sums * shares, "y_values": sums * (1 - shares), "rises": rises}
    axis = {"name": "c", "symbol": "$c$", "unit": "N s/m"}
    found = {
        "x": axis,
        "y": {**axis, "name": "c_p", "symbol": "$c_p$"},
        "grids": [{key: np.asarray(each).tolist() for key, each in grid.items()}],
        "best": [9.0, 1.0],
    }
    path = tmp_path / "v.json"
    path.write_text(json.dumps({"quantities": [], "trades": [], "notes": [], "valley": found}))
    rows = {"c_Ns_per_m": [3.0, 4e4, 5.0], "c_p_Ns_per_m": [7.0, 10.0, 5.0]}
    frame = pd.DataFrame(rows).assign(case="x", method="least_squares", seed=range(3))
    for column in ("misfit_rad", "noise_rms_rad", "generations", "evaluations", "stop_reason"):
        frame[column] = 1
    frame.to_csv(tmp_path / "found.csv", index=False)
    settings = valley.Settings("A drop", "least_squares", {}, {})
    with styled():
        axes = valley.draw(settings, path, tmp_path / "found.csv").axes[0]
    (beyond,) = (line for line in axes.lines if line.get_label() == "beyond the axis")
    np.testing.assert_allclose(np.asarray(beyond.get_xydata()), [[11.5, 10.0]])
    assert beyond.get_marker() == ">"


def test_the_overview_marks_what_is_off_its_axis() -> None:
    with styled():
        page = figure(3, 3)
        axes = page.subplots()
        places, ratios = np.arange(4.0), np.array([1e-5, 0.5, 2.0, 1e7])
        overview._points(axes, places, ratios, "red", "a fit")
    drawn_at = {line.get_marker(): np.asarray(line.get_xydata()) for line in axes.lines}
    np.testing.assert_allclose(drawn_at["v"], [[0, 1e-3]])
    np.testing.assert_allclose(drawn_at["^"], [[3, 1e3]])
    assert len(drawn_at["o"]) == 2
