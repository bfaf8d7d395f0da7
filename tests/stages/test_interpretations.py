"""Interpretations of section 4: each found as if the study had said so, and told in one table."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.products.plan import Plan
from biogrip.records.identifications import BATCHES, read_identifications
from biogrip.records.interpretations import INTERPRETATIONS
from biogrip.stages.identification import IDENTIFICATION
from biogrip.stages.interpretations import READ
from biogrip.stages.measurement import MEASUREMENT
from biogrip.stages.target import TARGET
from biogrip.study.study import Study
from biogrip.tables.interpretations import INTERPRETATIONS_TABLE
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
CASE = {"case": "liquid_drop_2"}


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of(OVERLAY)


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the interpretations have been tried, and the study's own algorithm."""
    made = tmp_path_factory.mktemp("interpretations")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(made)
        plan = Plan(study, Path("results"))
        batch = {"batch": "seeds_0-2"}
        TARGET.run(plan, CASE)
        MEASUREMENT.run(plan, CASE | batch)
        IDENTIFICATION.run(plan, CASE | batch | {"method": "genetic"})
        READ.run(plan, CASE)
        INTERPRETATIONS_TABLE.run(plan, {})
    return made


def test_a_reading_that_changes_nothing_finds_what_the_study_finds(folder: Path) -> None:
    path = folder / BATCHES.format(case="liquid_drop_2", method="genetic", batch="seeds_0-2")
    ours = read_identifications(path)
    rows = INTERPRETATIONS.read(folder / INTERPRETATIONS.path.format(**CASE))
    same = rows[rows["interpretation"] == "printed"].reset_index(drop=True)
    for column in ("k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m", "misfit"):
        np.testing.assert_array_equal(same[column], ours[column])
    np.testing.assert_array_equal(same["noise_rms"], ours["noise_rms"])
    for name in ("three", "uniform"):
        others = rows[rows["interpretation"] == name].reset_index(drop=True)
        assert not np.array_equal(others["misfit"], same["misfit"]), name


def test_the_table_has_a_row_for_each_case_and_reading(folder: Path) -> None:
    lines = (folder / "results/tables/interpretations.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[1] for line in lines[1:]] == [
        "as printed",
        "patient",
        "three digits",
        "uniform noise",
    ]


def test_a_reading_changes_only_what_it_says(study: Study) -> None:
    found = study.case(CASE["case"]).interpretations
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
    assert len(study_of(text).interpretations) == 12
