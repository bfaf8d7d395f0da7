"""What runs again, and what does not."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.workflow.conftest import ROOT, SMALL, Run, snakemake, tables

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


def test_adding_a_case_plans_that_case_and_what_puts_cases_together(study: Path) -> None:
    run = snakemake(study, "-n", config=SMALL + NEW_CASE)
    assert run.status == 0, run.output
    together = {"all_errors_table", "linearisation", "linearisation_table", "linearisation_figure"}
    together |= {"methods_table", "models_table", "coverage_table", "timings_table"}
    together |= {"overview_figure"}
    jobs = run.all_jobs()
    assert together <= set(jobs)
    assert {rule: jobs.pop(rule) for rule in together} == dict.fromkeys(together, 1)
    # Two batches of seeds, three methods; what is left is done once for the case.
    batches = {"measurement": 2, "identification": 6, "selection": 2, "coverage": 3, "joined": 3}
    assert {rule: jobs.pop(rule) for rule in batches} == batches
    assert set(jobs.values()) == {1}


def test_a_setting_of_the_genetic_algorithm_leaves_other_methods_alone(study: Path) -> None:
    run = snakemake(study, "-n", config=SMALL.replace("population: 60", "population: 62"))
    assert run.status == 0, run.output
    assert run.jobs("identification") == 4
    assert not {"target", "measurement", "selection", "coverage"} & set(run.all_jobs())
    assert run.output.count(" by genetic, ") == run.output.count("Identifying ") == 4


@dataclass(frozen=True)
class Tree:
    """A copy of the repository that may be edited, and a study that it finished."""

    root: Path
    study: Path

    def plan(self, *arguments: str) -> Run:
        return snakemake(
            self.study,
            *arguments,
            root=self.root,
            environment={"PYTHONPATH": str(self.root / "src")},
        )


@pytest.fixture(scope="module")
def tree(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Tree:
    folder = tmp_path_factory.mktemp("tree")
    for name in ("src", "workflow", "config", "profiles"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "Snakefile", folder)
    shutil.copytree(finished, folder / "study")
    copied = Tree(folder, folder / "study")
    # As if this copy of the code had made the results.
    assert copied.plan("--touch").status == 0
    assert "Nothing to be done" in copied.plan("-n").output
    return copied


@pytest.mark.parametrize(
    ("file", "jobs"),
    [
        ("workflow/report/errors.rst", {}),
        ("src/biogrip/figures/fit.py", {"fit_figure": 2, "summary": 2}),
        ("src/biogrip/tables/models.py", {"models_table": 1}),
    ],
)
def test_an_edit_reruns_exactly_what_it_is_used_in(
    tree: Tree, file: str, jobs: dict[str, int]
) -> None:
    with edited(tree.root / file):
        assert tree.plan("-n").all_jobs() == jobs


def test_an_edited_method_reruns_its_identifications_and_what_follows(tree: Tree) -> None:
    with edited(tree.root / "src/biogrip/identify/differential_evolution.py"):
        run = tree.plan("-n")
    jobs = run.all_jobs()
    assert (jobs["identification"], jobs["collection"], jobs["error_table"]) == (4, 2, 2)
    untouched = {"target", "measurement", "identifiability", "expected_identifiability"}
    untouched |= {"selection", "coverage", "linearisation", "input_table", "input_figure"}
    assert not untouched & set(jobs)


@contextmanager
def edited(file: Path) -> Iterator[None]:
    """Add a line to a file for a while, and put its time back with its content."""
    content, times = file.read_text(), file.stat()
    file.write_text(content + "\n# edited\n")
    yield
    file.write_text(content)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
