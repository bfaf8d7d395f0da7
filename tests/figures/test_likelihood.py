"""Profiles and valleys as they are drawn, read back from their axes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from biogrip.figures.likelihood import draw_profiles, draw_valley
from biogrip.figures.style import styled
from biogrip.fit.methods import METHODS
from tests.helpers.default import seen

BEST = 2.0


def item(**changes: Any) -> dict[str, Any]:
    """A quantity whose profile is a parabola of its logarithm, with few points."""
    values = BEST * np.exp(np.linspace(-1, 1, 9))
    profile = {"values": list(values), "increases": list((4 * np.log(values / BEST)) ** 2)}
    limits = {"low": BEST * np.exp(-0.49), "high": BEST * np.exp(0.49), "excluded": []}
    words = {"quantity": "k", "symbol": "$k$", "unit": "N/m", "verdict": "determined"}
    return {**words, **limits, "profile": profile, **changes}


def drawn(folder: Path, **changes: Any) -> Any:
    """Axes of a profile."""
    content = {"quantities": [item(**changes)], "trades": [], "notes": []}
    levels = {"confidence": 0.9, "threshold": 2.71, "certainty": 10.83}
    (folder / "v.json").write_text(json.dumps({**content, **levels}))
    with styled():
        case = seen(title="A drop", parameters={"k": 2.2})
        return draw_profiles(case, folder / "v.json", []).axes[0]


def test_a_set_in_two_parts_is_shaded_in_two_parts(tmp_path: Path) -> None:
    axes = drawn(tmp_path, excluded=[[1.9, 2.1]])
    spans = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    edges = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in spans]
    assert [round(end, 3) for pair in edges for end in pair] == [1.225, 1.9, 2.1, 3.265]


def drawn_valley(
    folder: Path, increases: list[list[float]], fits: dict[str, list[float]], **known: Any
) -> Any:
    """Axes of a valley along the sum of 10, with sums of 9, 10 and 11."""
    shares = np.linspace(0.1, 0.9, 5)
    sums = 10 * np.array([[0.9], [1.0], [1.1]])
    grid = {"x_values": sums * shares, "y_values": sums * (1 - shares), "increases": increases}
    axis = {"name": "c", "symbol": "$c$", "unit": "N s/m"}
    found = {
        "x": axis,
        "y": {**axis, "name": "c_p", "symbol": "$c_p$"},
        "grids": [{key: np.asarray(each).tolist() for key, each in grid.items()}],
        "best": [9.0, 1.0],
    }
    path = folder / "v.json"
    path.write_text(json.dumps({"quantities": [], "trades": [], "notes": [], "valley": found}))
    rows = {f"{name}_Ns_per_m": values for name, values in fits.items()}
    frame = pd.DataFrame(rows).assign(case="x", method="least_squares", misfit=1, noise_rms=1)
    frame = frame.assign(seed=range(len(frame)), generations=1, evaluations=1, stop_reason=1)
    frame.to_csv(folder / "found.csv", index=False)
    paper = seen(identified=known.get("paper", {}))
    study = seen(fitting_method=METHODS["least_squares"])
    case = seen(title="A drop", study=study, parameters=known.get("truth", {}), published=paper)
    with styled():
        return draw_valley(case, path, folder / "found.csv").axes[0]


KNOWN = ("truth", "paper")
DEEP = [[50.0] * 5, [0.0] * 5, [60.0] * 5]
# Deep at its last point alone, where c is 9.
CLOSED = [[900.0] * 5, [900.0, 900.0, 900.0, 900.0, 0.0], [900.0] * 5]


@pytest.mark.parametrize(
    ("c", "paper"), [([3.0, 4e4, 5.0], {}), ([3.0, 5.0, 5.0], {"c": 1e5, "c_p": 10.0})]
)
def test_fits_and_a_paper_beyond_a_valleys_axes_are_marked(
    tmp_path: Path, c: list[float], paper: dict[str, float]
) -> None:
    axes = drawn_valley(tmp_path, DEEP, {"c": c, "c_p": [7.0, 10.0, 5.0]}, paper=paper)
    (beyond,) = (line for line in axes.lines if line.get_label() == "beyond the axis")
    np.testing.assert_allclose(np.asarray(beyond.get_xydata()), [[11.5, 10.0]])
    assert beyond.get_marker() == ">"


def test_a_valleys_axes_end_around_what_is_in_it(tmp_path: Path) -> None:
    """Fits, truth, paper and where it is deep; each of them widens the axes, none is cut off."""
    near = {"c": [8.9, 9.05], "c_p": [1.1, 0.95]}
    narrow = drawn_valley(tmp_path, CLOSED, near)
    # The root of the rise, 30 at the next point, (7, 3), is below that of 10.83 for 0.11 of the way
    # there, which is as far as (8.78, 1.22); the fits end at (9.05, 0.95).
    low, high = narrow.get_xlim()
    assert 8.5 < low < 8.78 < 9.05 < high < 9.3
    low, high = narrow.get_ylim()
    assert 0.7 < low < 0.95 < 1.22 < high < 1.5
    wide = drawn_valley(tmp_path, DEEP, near)
    assert wide.get_xlim()[0] < 1
    assert wide.get_xlim()[1] > 9
    known = {"c": 6.0, "c_p": 4.0}
    more = drawn_valley(tmp_path, CLOSED, {"c": [6.0, 9.05], "c_p": [4.0, 0.95]})
    for axes in (more, *(drawn_valley(tmp_path, CLOSED, near, **{n: known}) for n in KNOWN)):
        assert axes.get_xlim()[0] < 6 < 9.05 < axes.get_xlim()[1]
        assert axes.get_ylim()[0] < 0.95 < 4 < axes.get_ylim()[1]
