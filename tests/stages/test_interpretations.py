"""Interpretations of section 4: each found as if the study had said so, and told in one table."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.records.identifications import INTERPRETATIONS, read_identifications
from biogrip.stages.identification import identify
from biogrip.stages.sweeps import identify_interpreted
from biogrip.stages.targets import measure, simulate
from biogrip.study.study import Study
from biogrip.tables.interpretations import interpretations
from tests.helpers.default import study_of
from tests.helpers.places import ROOT

OVERLAY = """
seeds: 3
methods: [genetic]
measurement: {rate_Hz: 1.0}
genetic_algorithm: {population: 40, survivors: 20, max_generations: 40}
cases: {liquid_drop_1: null, endothelial_cell: null}
interpretations:
  printed: {title: as printed, changes: {}}
  patience: {title: patient, changes: {genetic_algorithm: {min_generations: 40}}}
  three:
    title: three digits
    changes: {search_range: {k: {digits: 3, digit: [0, 9]}}}
  uniform: {title: uniform noise, changes: {measurement: {noise: {kind: uniform}}}}
"""
CASE = "liquid_drop_2"


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of(OVERLAY)


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the interpretations have been tried, and the study's own algorithm."""
    made = tmp_path_factory.mktemp("interpretations")
    target, measured = made / "t.csv", made / "m.parquet"
    case = study.case(CASE)
    simulate(case, target)
    measure(case, range(3), target, measured)
    outputs = [made / name for name in ("ours.csv", "h.parquet", "times.csv")]
    identify(case, "genetic", range(3), measured, [], *outputs)
    identify_interpreted(case, target, made / f"{CASE}.csv")
    return made


def test_a_reading_that_changes_nothing_finds_what_the_study_finds(folder: Path) -> None:
    ours = read_identifications(folder / "ours.csv")
    rows = INTERPRETATIONS.read(folder / f"{CASE}.csv")
    same = rows[rows["interpretation"] == "printed"].reset_index(drop=True)
    for column in ("k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m", "misfit"):
        np.testing.assert_array_equal(same[column], ours[column])
    np.testing.assert_array_equal(same["noise_rms"], ours["noise_rms"])
    for name in ("three", "uniform"):
        others = rows[rows["interpretation"] == name].reset_index(drop=True)
        assert not np.array_equal(others["misfit"], same["misfit"]), name


def test_the_table_has_a_row_for_each_case_and_reading(study: Study, folder: Path) -> None:
    made = interpretations(study, [folder / f"{CASE}.csv"])
    assert [row[1] for row in made.rows] == [
        "as printed",
        "patient",
        "three digits",
        "uniform noise",
    ]


def test_a_reading_changes_only_what_it_says(study: Study) -> None:
    found = study.case(CASE).interpretations
    assert found["patience"].problem == found["printed"].problem
    assert (found["printed"].genetic.patience, found["patience"].genetic.min_generations) == (
        20,
        40,
    )
    assert found["three"].problem.ranges["k"].digits == 3
    assert found["uniform"].noise.kind == "uniform"


def test_a_reading_that_no_case_can_have_is_explained() -> None:
    with pytest.raises(
        BiogripError,
        match=r"interpretations.odd.changes.genetic_algorithm.survivors: found 500, allowed",
    ):
        study_of(
            "interpretations: {odd: {title: odd, changes: {genetic_algorithm: {survivors: 500}}}}"
        )


def test_the_overlay_that_is_published_is_a_study() -> None:
    text = (ROOT / "config" / "interpretations.yaml").read_text(encoding="utf-8")
    assert len(study_of(text).interpretation_titles) == 12
