from itertools import product
from pathlib import Path

import numpy as np
import pytest

from biogrip.files import write_rows
from biogrip.judging.likelihood import bounds_percent
from biogrip_study.records.identifications import identification_columns
from biogrip_study.stages.targets import noise_of_readings
from biogrip_study.tables import sweeps as stage
from biogrip_study.tables.study import bounds_at_truth
from biogrip_study.tables.sweeps import headlines, robustness
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


STUDY = study_of(SWEEPS)


@pytest.fixture(scope="module")
def batches(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Five seeds: k = 0.7, 0.8, 0.9, 1, 0.3 of 35 and c = 330, c_p = 1; misfits 1 to 1.04 noise."""
    folder, files = tmp_path_factory.mktemp("sweep"), []
    # The truth with two digits of 1 to 9: 300 has none.
    rounded = rotation(MODEL, [35.0, 12.0, 290.0, 0.99e-3], TIME_S)
    resolution = np.sqrt(np.mean((rounded - rotation(MODEL, TRUTH, TIME_S)) ** 2))
    for name, method in product(STUDY.points, ("genetic", "least_squares")):
        noise, genetic = 0.0 if "--0--" in name else 1e-6, method == "genetic"
        # Least squares is right, and without noise exactly.
        misfits = (noise or resolution * genetic) * (1 + 0.01 * np.arange(5) * genetic)
        ends = noise, 60, 15500, "stalled"
        rows = [[name, method, n, K[n], 12.3, 330, 1, misfits[n], *ends] for n in range(5)]
        files.append(folder / name / method / "seeds_0-4.csv")
        files[-1].parent.mkdir(parents=True)
        write_rows(files[-1], identification_columns(MODEL), rows)
    return files


def test_judged_points_are_the_arithmetic_they_say(batches: list[Path]) -> None:
    of_level = {
        name.split("--")[2]: name for name in STUDY.points if name.endswith("gaussian-peak")
    }
    judged = {}
    for level, name in of_level.items():
        case = STUDY.points[name]
        bounds = {q.label: bound for q, bound in bounds_at_truth(case)}
        assert {*np.isnan([*bounds.values()])} == {level == "0"}
        judged[level] = stage.judge_point(case, bounds, ["k", "k_p", "c + c_p"], batches)
    noisy = judged["0_2"]
    # |35 - k| / 35: 0, 10, 20, 30 and 70 %, the last outside a factor of two.
    assert noisy["k"]["error_genetic"] == pytest.approx(20.0)
    assert noisy["k"]["basin_error_genetic"] == pytest.approx(15.0)
    assert {row["basin_genetic"] for row in noisy.values()} == {0.8}
    total = 100 * (331 - 299.901) / 299.901
    assert noisy["c + c_p"]["error_genetic"] == pytest.approx(total, rel=1e-5)
    # 1, 1.01 and 1.02 times the noise are within 2 % of it, or of what two digits can do.
    for told in judged.values():
        assert told["k"]["near_noise_genetic"] == 0.6
        assert told["k"]["near_noise_least_squares"] == 1.0


@pytest.mark.parametrize("column", ["gaussian-peak", "uniform-signal"])
def test_bounds_are_those_of_least_squares(column: str) -> None:
    """The sandwich covariance of log k, log k_p, log c from central differences."""
    (case,) = (of for name, of in STUDY.points.items() if name.endswith(f"--0_2--{column}"))
    found = {quantity.label: bound for quantity, bound in bounds_at_truth(case)}
    above, below = (
        np.array([rotation(MODEL, TRUTH * np.exp(h), TIME_S) for h in away * np.eye(4)[:3]])
        for away in (1e-5, -1e-5)
    )
    phi, jacobian = rotation(MODEL, TRUTH, TIME_S), (above - below) / 2e-5
    sigma = 0.2 * (np.full_like(phi, phi.max()) if column == "gaussian-peak" else np.abs(phi))
    errors = np.linalg.solve(jacobian @ jacobian.T, jacobian * sigma)
    wanted = 100 * np.linalg.norm(errors, axis=1)
    np.testing.assert_allclose([found[q] for q in ("k", "k_p", "c")], wanted, rtol=1e-3)
    # Of c_p = 1e-3 beside c = 299.9 the trace carries no information.
    assert np.isinf(found["c_p"])


def test_bounds_are_of_the_noise_that_traces_have_whatever_gripper_is_assumed() -> None:
    """Arms that are thought twice as stiff would turn less, and the noise of the peak is less."""
    off = "{left: {stiffness_Nm_per_rad: 8.8e-7}, right: {stiffness_Nm_per_rad: 8.8e-7}}"
    case = study_of(f"cases: {{{CASE}: {{assumed_gripper: {off}}}}}").cases[CASE]
    level = float(noise_of_readings(case, case.times_s)[0])
    stated = np.full_like(case.times_s, level)
    same = bounds_percent(case.experiment, stated, case.parameters, case.times_s)
    assert bounds_at_truth(case) == same
    assert level == pytest.approx(0.1 * rotation(MODEL, TRUTH, TIME_S).max())


def test_the_table_has_the_best_and_the_worst_determined(batches: list[Path]) -> None:
    rows = robustness(STUDY, "both", batches).rows
    levels, kinds = ("0", "20"), ("additive, any", "proportional")
    wanted = [*product(("k_p", "k"), levels, kinds)]
    assert [(row["quantity"], row["row"], row["column"]) for row in rows] == wanted
    assert STUDY.config.sweeps["both"].rows.title == "level (%)"
    # Without noise no error is told that is less.
    assert rows[0]["error_least_squares"] == 1.0
    last = {"near_noise_genetic": 0.6, "near_noise_least_squares": 1.0, "basin_genetic": 0.8}
    last |= {"basin_error_genetic": 15.0, "error_genetic": 20.0}
    assert {**rows[-1], **last} == rows[-1]


def _bounds(**percent: list[float]) -> list[tuple[str, float]]:
    return [(q.replace("_and_", " + "), p) for q, values in percent.items() for p in values]


def test_headlines_follow_from_the_bounds() -> None:
    assert headlines(_bounds(k=[50, 60], k_p=[5, 6], c=[1, 2])) == ["c", "k"]
    # A sum stands for its parts, whatever their bounds.
    sums = _bounds(c=[1, 1], c_p=[2, 2], c_and_c_p=[3, 3], k=[99, 98])
    assert headlines(sums) == ["c + c_p", "k"]
    assert headlines(_bounds(k=[99, 400, 400], c=[1, 1, np.nan])) == ["c"]
    assert headlines(_bounds(k=[400.0])) == []


def test_the_basin_of_truth_is_as_wide_as_noise_makes_it() -> None:
    values, narrow = 10.0 * np.array([0.4, 0.6, 1.9, 2.1]), [False, True, True, False]
    for bound, inside in ((0.05, narrow), (0.5, [True] * 4), (np.nan, narrow)):
        assert stage.in_basin(values, 10.0, bound).tolist() == inside
