"""Readings of section 4: each found as if the study had said so."""

from pathlib import Path

import numpy as np

from biogrip.records.identifications import READINGS, read_identifications
from biogrip.stages.identification import identify
from biogrip.stages.targets import measure, simulate
from tests.helpers.default import study_of
from workflow.paper.readings import found_by_readings, read
from workflow.paper.readings_of_case import identify_readings

OVERLAY = """
seeds: 3
methods: [genetic]
measurement: {rate_Hz: 1.0}
genetic_algorithm: {population: 40, survivors: 20, max_generations: 40}
cases: {liquid_drop_1: null, endothelial_cell: null}
readings:
  printed: {title: as printed, changes: {}}
  patience: {title: patient, changes: {genetic_algorithm: {min_generations: 40}}}
  three:
    title: three digits
    changes: {search_range: {k: {digits: 3, digit: [0, 9]}}}
  uniform: {title: uniform noise, changes: {measurement: {noise: {kind: uniform}}}}
  slow: {title: slow, changes: {measurement: {rate_Hz: 0.5}}}
"""
CASE = "liquid_drop_2"


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
