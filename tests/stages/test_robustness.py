"""The robustness stage, its table and its heat maps: numbers recomputed by hand."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from biogrip.arrays import Array
from biogrip.judging.likelihood import headlines
from biogrip.physics.models import MODELS
from biogrip.records.identifications import columns
from biogrip.records.rows import write_rows
from biogrip.stages import sweeps as stage
from biogrip.study.study import Study
from biogrip.tables.sweeps import robustness
from tests.helpers.default import study_of
from tests.helpers.problems import MODEL, rotation

CASE = "endothelial_cell"
TRUTH = np.array([35.0, 12.3, 299.9, 1e-3])
SWEEPS = """
methods: [genetic, least_squares]
sweeps:
  both:
    title: Level and kind
    cases: [endothelial_cell]
    rows:
      {label: level, unit: "%", unit_in_si: 0.01, key: measurement.noise.level, values: [0, 0.2]}
    columns:
      label: kind
      key: measurement.noise
      values:
        - {label: "additive, any", kind: gaussian, reference: peak}
        - {label: proportional, kind: uniform, reference: signal}
"""
TIME_S = np.arange(4001) / 10.0
K = 35 * np.array([0.7, 0.8, 0.9, 1.0, 0.3])


@pytest.fixture
def study() -> Study:
    return study_of(SWEEPS)


@pytest.fixture
def identifications(study: Study, tmp_path: Path) -> list[Path]:
    """Five seeds: k = 0.7, 0.8, 0.9, 1, 0.3 of 35 and c = 330, c_p = 1; misfits 1 to 1.04 noise."""
    files = []
    for name in study.points:
        noise = 0.0 if "--0--" in name else 1e-6
        for method in ("genetic", "least_squares"):
            rows = []
            for seed in range(5):
                # Least squares is right, and without noise exactly.
                own = noise if method == "least_squares" else noise or _resolution()
                misfit = own * (1 + 0.01 * seed * (method == "genetic"))
                row = [name, method, seed, K[seed], 12.3, 330, 1]
                rows.append([*row, misfit, noise, 60, 15500, "stalled"])
            files.append(tmp_path / name / method / "seeds_0-4.csv")
            files[-1].parent.mkdir(parents=True)
            write_rows(files[-1], columns(MODELS["generalized_maxwell"]), rows)
    return files


@pytest.fixture
def judged(study: Study, identifications: list[Path], tmp_path: Path) -> Path:
    stage.judge(study, "both", identifications, [], tmp_path / "judged" / f"{CASE}.csv")
    return tmp_path / "judged" / f"{CASE}.csv"


def _resolution() -> float:
    """Misfit of the truth with two digits of 1 to 9: 35, 12, 290 (300 has none) and 0.99e-3."""
    rounded = rotation(MODEL, np.array([35.0, 12.0, 290.0, 0.99e-3]), TIME_S)
    return float(np.sqrt(np.mean((rounded - rotation(MODEL, TRUTH, TIME_S)) ** 2)))


def _by_hand(relative_sigma: Array) -> Array:
    """Sandwich covariance of log k, log k_p, log c from central differences."""
    ends = (
        (rotation(MODEL, TRUTH * np.exp(h), TIME_S), rotation(MODEL, TRUTH * np.exp(-h), TIME_S))
        for h in 1e-5 * np.eye(4)
    )
    jacobian = np.array([(up - down) / 2e-5 for up, down in ends])[:3]
    inverse = np.linalg.inv(jacobian @ jacobian.T)
    spread: Array = (jacobian * relative_sigma) @ (jacobian * relative_sigma).T
    return inverse @ spread @ inverse


def test_judged_points_are_the_arithmetic_they_say(judged: Path) -> None:
    rows = pd.read_csv(judged, dtype={"row": str, "column": str})
    assert tuple(rows.columns) == stage.POINTS.columns
    assert len(rows) == 4 * 2 * 5
    index = rows.set_index(["row", "column", "method", "quantity"]).sort_index()
    noisy = index.loc[("20", "additive, any", "genetic")]
    # |35 - k| / 35: 0, 10, 20, 30 and 70 %, the last outside a factor of two.
    assert noisy.loc["k", "median_absolute_error_percent"] == pytest.approx(20.0)
    assert noisy.loc["k", "basin_error_percent"] == pytest.approx(15.0)
    assert (noisy["basin_share"] == 0.8).all()
    total = 100 * (331 - 299.901) / 299.901
    assert noisy.loc["c + c_p", "median_absolute_error_percent"] == pytest.approx(total, rel=1e-5)
    # 1, 1.01 and 1.02 times the noise are within 2 % of it.
    assert noisy.loc["k", "near_noise_share"] == 0.6
    assert (noisy["seeds"] == 5).all()


def test_without_noise_the_floor_is_what_two_digits_can_do(judged: Path) -> None:
    rows = pd.read_csv(judged, dtype={"row": str})
    clean = rows[rows["row"] == "0"].set_index("method")
    assert clean["bound_percent"].isna().all()
    for method, share in (("genetic", 0.6), ("least_squares", 1.0)):
        assert clean.loc[method, "near_noise_share"].tolist() == [share] * 10


@pytest.mark.parametrize("column", ["additive, any", "proportional"])
def test_bounds_are_those_of_least_squares(judged: Path, column: str) -> None:
    rows = pd.read_csv(judged, dtype={"row": str})
    chosen = rows[(rows["row"] == "20") & (rows["column"] == column)]
    found = chosen[chosen["method"] == "genetic"].set_index("quantity")["bound_percent"]
    phi = rotation(MODEL, TRUTH, TIME_S)
    sigma = 0.2 * (np.full_like(phi, phi.max()) if column == "additive, any" else np.abs(phi))
    wanted = 100 * np.sqrt(np.diag(_by_hand(sigma)))
    np.testing.assert_allclose(found[["k", "k_p", "c"]], wanted, rtol=1e-3)
    # Of c_p = 1e-3 beside c = 299.9 the trace carries no information.
    assert np.isinf(found["c_p"])


def test_the_table_has_the_best_and_the_worst_determined(study: Study, judged: Path) -> None:
    table = robustness(study, "both", judged)
    rows = table.rows
    assert [(row["quantity"], row["row"], row["column"]) for row in rows] == [
        (quantity, level, kind)
        for quantity in ("k_p", "k")
        for level in ("0", "20")
        for kind in ("additive, any", "proportional")
    ]
    # Without noise no error is told that is less.
    assert rows[0]["error_least_squares"] == 1.0
    assert rows[-1]["near_noise_genetic"] == 0.6
    assert rows[-1]["near_noise_least_squares"] == 1.0
    assert rows[-1]["basin_genetic"] == 0.8
    assert (rows[-1]["basin_error_genetic"], rows[-1]["error_genetic"]) == (15.0, 20.0)


def _bounds(**percent: list[float]) -> list[tuple[str, float]]:
    return [(q.replace("_and_", " + "), p) for q, values in percent.items() for p in values]


def test_headlines_follow_from_the_bounds() -> None:
    assert headlines(_bounds(k=[50, 60], k_p=[5, 6], c=[1, 2])) == ["c", "k"]
    # A sum stands for its parts, whatever their bounds.
    assert headlines(_bounds(c=[1, 1], c_p=[2, 2], c_and_c_p=[3, 3], k=[99, 98])) == [
        "c + c_p",
        "k",
    ]
    assert headlines(_bounds(k=[99, 400, 400], c=[1, 1, np.nan])) == ["c"]
    assert headlines(_bounds(k=[400.0])) == []


@pytest.mark.parametrize(
    ("bound", "inside"),
    [(0.05, [False, True, True, False]), (0.5, [True] * 4), (np.nan, [False, True, True, False])],
)
def test_the_basin_of_the_truth_is_as_wide_as_noise_makes_it(
    bound: float, inside: list[bool]
) -> None:
    values = 10.0 * np.array([0.4, 0.6, 1.9, 2.1])
    assert stage.in_basin(values, 10.0, bound).tolist() == inside
