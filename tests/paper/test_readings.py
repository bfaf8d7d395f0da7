"""Which reading can have printed the paper's tables: counts of values, kernels by hand, runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.records.identifications import READINGS, read_identifications
from biogrip.stages.identification import identify
from biogrip.stages.targets import measure, simulate
from biogrip.study.study import Study
from tests.helpers.default import study_of
from tests.helpers.places import ROOT
from workflow.paper.readings import (
    able,
    found_by_readings,
    log_likelihood,
    log_likelihood_of_generations,
    printable,
    read,
    readings,
)
from workflow.paper.readings_of_case import identify_readings

CASE = "liquid_drop_2"
ALL = study_of((ROOT / "config" / "readings.yaml").read_text(encoding="utf-8"))
FEW = """
seeds: 4
methods: [genetic]
cases: {endothelial_cell: null, liquid_drop_1: null}
readings:
  printed: {title: as printed, changes: {}}
  other: {title: other, changes: {}}
"""


@pytest.mark.parametrize(
    ("reading", "exactly"),
    [
        # Written out by hand: of 32.8, 12.3, 302.5, 1e-4; 6.7, 5.6e-5, 9.7, 0.23; 0.97, 5.6e-5,
        # 9.7, 0.25 two digits have six; zeros add 1e-4, a third digit 32.8 and 12.3, a zero in
        # front of it 5.6e-5 twice, a fourth digit 302.5.
        *(("two", 6), ("two_others", 7), ("two_from_0", 7), ("three_others", 9)),
        *(("three_from_0", 11), ("four_others", 10), ("four_from_0", 12)),
    ],
)
def test_printed_values_are_counted_that_genes_hold(reading: str, exactly: int) -> None:
    counts = printable(ALL, reading)
    assert (counts["values"], counts["exactly"]) == (12, exactly)
    assert counts["with_error"] <= counts["rounded"] >= counts["exactly"]


def test_four_digits_with_zeros_in_front_can_print_all() -> None:
    assert able(ALL) == "four_from_0"
    assert printable(ALL, "four_from_0")["with_error"] == 12
    # 9.73 to 9.745 takes a third digit, 32.83 to 32.8825 a fourth.
    assert printable(ALL, "two")["with_error"] < printable(ALL, "three_from_0")["with_error"] < 12


# k, k_p, c, c_p, misfit, noise, stop, last improvement of each seed of drop 2: the paper has
# 0.97375, 9.9875 for c + c_p, 0.25 and generation 61.
HIT = (0.97375, 5.6e-5, 9.7375, 0.25, 1.0, 1.0, 80, 61)
AWAY = (0.97375 * np.exp(0.05), 5.6e-5, 9.7375, 0.25, 1.0, 1.0, 86, 66)
FAR = (0.1, 5.6e-5, 1.0, 9.0, 1.5, 1.0, 40, 20)


@pytest.fixture
def given(tmp_path: Path) -> tuple[Study, Any]:
    rows = [(CASE, "printed", n, *run) for n, run in enumerate((HIT, AWAY, AWAY, HIT))]
    rows += [(CASE, "other", n, *run) for n, run in enumerate((HIT, FAR, FAR, FAR))]
    READINGS.write(tmp_path / f"{CASE}.csv", rows)
    study = study_of(FEW)
    return study, read(study, [tmp_path / f"{CASE}.csv"])


def test_a_likelihood_is_the_mean_of_kernels(given: tuple[Study, Any]) -> None:
    """A run that is one width of 5 % away counts exp(-1/2); at twice the width exp(-1/8)."""
    study, found = given
    one = np.array([1, np.exp(-0.5), np.exp(-0.5), 1])
    mean, error = log_likelihood(study, found, "printed", 1.0)
    assert mean == pytest.approx(np.log10(one.mean()), abs=1e-3)
    # The delta method: deviation of the mean over the mean, in decades.
    deviation = one.std(ddof=1) / 2 / one.mean() / np.log(10)
    assert error == pytest.approx(deviation, rel=1e-2)
    wide, _ = log_likelihood(study, found, "printed", 2.0)
    assert wide == pytest.approx(np.log10((1 + np.exp(-1 / 8)) / 2), abs=1e-3)
    of_generations, _ = log_likelihood_of_generations(study, found, "other")
    assert of_generations == pytest.approx(np.log10(1 / 4), abs=1e-6)


def test_readings_are_compared_with_the_first_that_prints_most(given: tuple[Study, Any]) -> None:
    study, found = given
    first, second = readings(study, found).rows
    assert (first["likelihood"], first["likelihood_error"]) == (0, 0)
    assert second["likelihood"] == pytest.approx(np.log10(0.25 / 0.803), abs=2e-3)
    # Three far runs of four: a quarter of the mean, but no more than four runs tell.
    assert second["verdict"] == "not told apart"
    of_first, of_second = found_by_readings(study, found).rows
    assert (of_first["near_noise_share"], of_second["near_noise_share"]) == (1, 0.25)
    # Within 2.7 % in k and 0.26 % in c + c_p; the other two miss k by 2.4 %.
    assert (of_first["as_close_share"], of_second["as_close_share"]) == (1, 0.25)
    assert of_first["last_improvement"] == 63.5


OVERLAY = """
seeds: 3
methods: [genetic]
measurement: {rate_Hz: 1.0}
genetic_algorithm: {population: 40, survivors: 20, max_generations: 40}
cases: {liquid_drop_1: null, endothelial_cell: null}
readings:
  printed: {title: as printed, changes: {}}
  patience: {title: patient, changes: {genetic_algorithm: {min_generations: 40}}}
  three: {title: three digits, changes: {search_range: {k: {digits: 3, digit: [0, 9]}}}}
  uniform: {title: uniform noise, changes: {measurement: {noise: {kind: uniform}}}}
  slow: {title: slow, changes: {measurement: {rate_Hz: 0.5}}}
"""


def test_one_that_changes_nothing_finds_what_the_study_finds(tmp_path: Path) -> None:
    target, measured, ours_file = (tmp_path / name for name in ("t.csv", "m.npz", "ours.csv"))
    study = study_of(OVERLAY)
    case = study.case(CASE)
    simulate(case, target)
    measure(case, range(3), target, measured)
    identify(case, "genetic", range(3), measured, [], ours_file, tmp_path / "h.npz")
    interpreted = tmp_path / f"{CASE}.csv"
    identify_readings(case, target, interpreted)
    ours = read_identifications(ours_file, case)
    rows = READINGS.read(interpreted)
    same = rows[rows["reading"] == "printed"].reset_index(drop=True)
    for column in ("k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m", "misfit", "noise_rms"):
        np.testing.assert_array_equal(same[column], ours[column])
    for name in ("three", "uniform", "slow"):
        assert set(rows[rows["reading"] == name]["misfit"]) != set(same["misfit"]), name
    titles = [row["reading"] for row in found_by_readings(study, read(study, [interpreted])).rows]
    assert titles == ["as printed", "patient", "three digits", "uniform noise", "slow"]
