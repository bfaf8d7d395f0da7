"""What runs again, and what does not."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.workflow.conftest import SMALL, Tree, copied_tree, snakemake, tables

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
    assert (run.jobs("target"), run.jobs("measurement"), run.jobs("identification")) == (1, 2, 6)
    after = tables(study)
    joint = {f"tables/{name}" for name in ("errors", "linearisation", "methods", "models")}
    joint |= {"tables/coverage"}
    assert [
        name
        for name in before
        if before[name] != after[name] and name.rsplit(".", 1)[0] not in joint
    ] == []
    assert b"my_cell,liquid_drop" not in after["tables/errors.csv"]
    assert after["tables/errors.csv"].count(b"my_cell") == 3


def test_raising_the_seeds_reruns_no_finished_job_and_changes_no_number(study: Path) -> None:
    before = (study / "results/identifications/endothelial_cell.csv").read_text().splitlines()
    run = snakemake(
        study,
        "results/identifications/endothelial_cell.csv",
        config=SMALL.replace("seeds: 4", "seeds: 7"),
    )
    assert run.status == 0, run.output
    assert (run.jobs("target"), run.jobs("measurement"), run.jobs("identification")) == (0, 2, 6)
    after = (study / "results/identifications/endothelial_cell.csv").read_text().splitlines()
    assert set(before) < set(after)
    assert len(after) == 1 + 3 * 7


def test_an_odd_number_of_seeds_is_kept_too(study: Path) -> None:
    target = "results/identifications/liquid_drop_2.csv"
    for seeds, fresh in (("5", 1), ("9", 3), ("3", 0)):
        run = snakemake(study, target, config=SMALL.replace("seeds: 4", f"seeds: {seeds}"))
        assert run.status == 0, run.output
        assert run.jobs("identification") == 3 * fresh
        assert (study / target).read_text().count("\n") == 3 * int(seeds) + 1


@pytest.mark.parametrize(
    ("old", "new", "rerun"),
    [
        ("rate_Hz: 1.0", "rate_Hz: 2.0", {"target", "measurement", "identification"}),
        ("rate_Hz: 1.0", "rate_Hz: 1.0, noise: {level: 0.2}", {"measurement", "identification"}),
        ("population: 60", "population: 62", {"identification"}),
        ("seeds: 4", "seeds: 4\nevaluation: {near_noise_tolerance: 0.03}", set()),
    ],
)
def test_a_setting_reruns_what_depends_on_it(
    study: Path, old: str, new: str, rerun: set[str]
) -> None:
    run = snakemake(study, "-n", config=SMALL.replace(old, new))
    assert run.status == 0, run.output
    stages = {"target", "measurement", "identification"}
    assert {stage for stage in stages if run.jobs(stage)} == rerun
    assert run.jobs("case_tables") == 2


def test_adding_a_case_plans_that_case_and_what_puts_cases_together(study: Path) -> None:
    run = snakemake(study, "-n", config=SMALL + NEW_CASE)
    assert run.status == 0, run.output
    together = {"tables", "model_difference", "linearisation_map", "overview"}
    jobs = run.all_jobs()
    assert together <= set(jobs)
    assert {rule: jobs.pop(rule) for rule in together} == dict.fromkeys(together, 1)
    # Two batches of seeds, three methods; what is left is done once for the case.
    batches = {"measurement": 2, "identification": 6, "model_fits": 2, "intervals": 3}
    assert {rule: jobs.pop(rule) for rule in batches} == batches
    once = {"target", "identifications", "all_times", "all_intervals", "all_model_fits"}
    once |= {"judgement", "expectation", "summary", "case_tables", "judgement_tables"}
    once |= {"case_figures", "simulated_figures", "judgement_figures"}
    assert jobs == dict.fromkeys(once, 1)


def test_a_setting_of_the_genetic_algorithm_leaves_other_methods_alone(study: Path) -> None:
    run = snakemake(study, "-n", config=SMALL.replace("population: 60", "population: 62"))
    assert run.status == 0, run.output
    assert run.jobs("identification") == 4
    assert not {"target", "measurement", "model_fits", "intervals"} & set(run.all_jobs())
    assert run.output.count(" by genetic, ") == run.output.count("Identifying ") == 4


@pytest.fixture(scope="module")
def tree(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """A copy of the repository, and the study finished as if by it."""
    copied = copied_tree(tmp_path_factory.mktemp("tree"))
    shutil.copytree(finished, copied.study)
    assert copied.run("--touch").status == 0
    assert "Nothing to be done" in copied.run("-n").output
    return copied


@pytest.mark.parametrize(
    ("file", "jobs"),
    [
        ("workflow/report/product.rst", {}),
        ("src/biogrip/products/figures/fit.py", {"case_figures": 2, "summary": 2}),
        ("src/biogrip/products/tables/models.py", {"tables": 1}),
    ],
)
def test_an_edit_reruns_exactly_what_it_is_used_in(
    tree: Tree, file: str, jobs: dict[str, int]
) -> None:
    with edited(tree.root / file):
        assert tree.run("-n").all_jobs() == jobs


def test_an_edited_method_reruns_its_identifications_and_what_follows(tree: Tree) -> None:
    with edited(tree.root / "src/biogrip/identify/differential_evolution.py"):
        run = tree.run("-n")
    jobs = run.all_jobs()
    assert (jobs["identification"], jobs["identifications"], jobs["case_tables"]) == (4, 2, 2)
    untouched = {"target", "measurement", "judgement", "expectation", "model_fits", "intervals"}
    untouched |= {"model_difference", "input_tables", "input_figures"}
    assert not untouched & set(jobs)


@contextmanager
def edited(file: Path) -> Iterator[None]:
    """Add a line to a file for a while, and put its time back with its content."""
    content, times = file.read_text(), file.stat()
    file.write_text(content + "\n# edited\n")
    yield
    file.write_text(content)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
