"""The table of designed experiments: bounds against another way, seeds against what they are."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.identifiability.at_truth import bounds_percent
from biogrip.products.designed_cases import designed_cases
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.stages.judgement import expect
from biogrip.products.stages.target import simulate
from biogrip.products.tables.designed import designed
from biogrip.study.study import Study
from tests.helpers.default import study_of

OVERLAY = """
design: {noise_rad: 3.0e-6, readings: 100, fastest_Hz: 1.0e+5, longest_s: 4.0,
         largest_torque_Nm: 1.6e-9}
only: [endothelial_cell]
identifiability: {coverage_seeds: SEEDS}
cases:
  endothelial_cell:
    protocol:
      phases: [{duration_s: 100.0, torque_Nm: 1.6e-9}, {duration_s: 100.0, torque_Nm: 4.0e-10}]
    measurement:
      noise: {level_rad: 3.0e-6}
      bursts:
        - {from_s: 1.0e-5, rate_Hz: 1.0e+5, samples: 50}
        - {from_s: 50.0, rate_Hz: 20.0, samples: 200}
        - {from_s: 100.00001, rate_Hz: 1.0e+5, samples: 30}
        - {from_s: 150.0, rate_Hz: 20.0, samples: 200}
"""


def expected(study: Study, folder: Path) -> Path:
    """Verdicts of the case's trace without noise."""
    case, target, verdicts = study.case("endothelial_cell"), folder / "target", folder / "verdicts"
    simulate(case, target)
    expect(case, target, [], verdicts)
    return verdicts


def test_bounds_before_and_after(tmp_path: Path) -> None:
    study = study_of(OVERLAY.replace("SEEDS", "0"))
    table = designed(study, [expected(study, tmp_path)], [])
    rows = {row[1]: row for row in table.rows}
    assert list(rows) == ["k", "k_p", "c", "c_p"]
    # Jump, rate and plateau at 10 Hz: three observables for four parameters.
    assert [rows[name][5] for name in ("k", "c", "c_p")] == [None] * 3
    assert 0 < float(rows["k_p"][5] or 0) < 1
    assert [rows[name][7] for name in rows] == ["determined"] * 4
    case = study.cases["endothelial_cell"]
    times = case.sampling.over(case.problem.torque.end_s)
    bounds = bounds_percent(case.problem, case.noise, case.parameters, times)
    for quantity, bound in bounds[:4]:
        assert rows[quantity.label][6] == pytest.approx(bound, rel=1e-6)
        assert rows[quantity.label][8:12] == (None,) * 4
    # Force follows the torque of what springs back: a quarter of it, less what the hinges pull.
    lever = case.gripper.lever_m
    assert 0.5 < float(rows["k"][12] or 0) / (1e9 * 4e-10 / lever) < 1


def test_seeds_beside_it(tmp_path: Path) -> None:
    study = study_of(OVERLAY.replace("SEEDS", "4"))
    file = tmp_path / "intervals.csv"
    logs = np.array([-0.03, 0.01, 0.02, 0.04])
    lines = np.exp(np.stack((logs, logs - 0.035, logs + 0.035), axis=1)) * 35
    nothing = ("", "", "", "")
    rows = [
        ("endothelial_cell", "k", seed, *map("{:.12g}".format, line), *nothing)
        for seed, line in enumerate(lines)
    ]
    INTERVALS.write(file, rows)
    table = designed(study, [expected(study, tmp_path)], [file])
    row = next(row for row in table.rows if row[1] == "k")
    spread = 100 * np.std(logs, ddof=1)
    assert row[8] == pytest.approx(spread, rel=1e-6)
    assert row[9] == pytest.approx(spread / float(row[6] or 0), rel=1e-6)
    assert row[10:12] == (75.0, 4)


def test_only_cases_that_are_sampled_in_bursts_have_such_experiments() -> None:
    assert designed_cases(study_of()) == []
    assert designed_cases(study_of(OVERLAY.replace("SEEDS", "0"))) == ["endothelial_cell"]
    seldom = OVERLAY[: OVERLAY.index("      bursts:")].replace("SEEDS", "0")
    assert designed_cases(study_of(seldom)) == []
