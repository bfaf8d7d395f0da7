"""What runs again, and what does not."""

import shutil
from pathlib import Path

import pytest

from tests.workflow.conftest import SMALL, snakemake, tables

NEW_CASE = """  my_cell:
    sample: {model: liquid_drop, k: 20.0, k_p: 5.0, c: 8e1}
"""


@pytest.fixture
def study(finished: Path, tmp_path: Path) -> Path:
    """A copy of the finished study, file times kept."""
    folder = tmp_path / "study"
    shutil.copytree(finished, folder)
    return folder


def test_a_finished_study_has_nothing_to_do(study: Path) -> None:
    run = snakemake(study, "-n")
    assert "Nothing to be done" in run.output


def test_adding_a_case_reruns_no_finished_job_and_changes_no_number(study: Path) -> None:
    before = tables(study)
    run = snakemake(study, config=SMALL + NEW_CASE)
    assert run.status == 0, run.output
    assert (run.jobs("target"), run.jobs("measurement"), run.jobs("identification")) == (1, 2, 2)
    after = tables(study)
    joint = {"tables/errors", "tables/linearisation"}
    assert [
        name
        for name in before
        if before[name] != after[name] and name.rsplit(".", 1)[0] not in joint
    ] == []
    assert b"my_cell,liquid_drop" not in after["tables/errors.csv"]
    assert after["tables/errors.csv"].count(b"my_cell") == 3


def test_raising_the_seeds_reruns_no_finished_job_and_changes_no_number(study: Path) -> None:
    before = (study / "results/identifications/endothelial_cell.csv").read_text()
    run = snakemake(
        study,
        "results/identifications/endothelial_cell.csv",
        config=SMALL.replace("seeds: 4", "seeds: 7"),
    )
    assert run.status == 0, run.output
    assert (run.jobs("target"), run.jobs("measurement"), run.jobs("identification")) == (0, 2, 2)
    after = (study / "results/identifications/endothelial_cell.csv").read_text()
    assert after.startswith(before)
    assert after.count("\n") == 8


def test_an_odd_number_of_seeds_is_kept_too(study: Path) -> None:
    target = "results/identifications/liquid_drop_2.csv"
    for seeds, fresh in (("5", 1), ("9", 3), ("3", 0)):
        run = snakemake(study, target, config=SMALL.replace("seeds: 4", f"seeds: {seeds}"))
        assert run.status == 0, run.output
        assert run.jobs("identification") == fresh
        assert (study / target).read_text().count("\n") == int(seeds) + 1


@pytest.mark.parametrize(
    ("old", "new", "rerun"),
    [
        ("rate_Hz: 1.0", "rate_Hz: 2.0", {"target", "measurement", "identification"}),
        ("rate_Hz: 1.0", "rate_Hz: 1.0, noise: {level: 0.2}", {"measurement", "identification"}),
        ("population: 60", "population: 62", {"identification"}),
        ("seeds: 4", "seeds: 4\nevaluation: {noise_floor_tolerance: 0.03}", set()),
    ],
)
def test_a_setting_reruns_what_depends_on_it(
    study: Path, old: str, new: str, rerun: set[str]
) -> None:
    run = snakemake(study, "-n", config=SMALL.replace(old, new))
    assert run.status == 0, run.output
    stages = {"target", "measurement", "identification"}
    assert {stage for stage in stages if run.jobs(stage)} == rerun
    assert run.jobs("error_table") == 2
