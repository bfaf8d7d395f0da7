"""What runs again, and what does not."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from biogrip.records.differences import DIFFERENCES
from tests.helpers.default import study_of
from tests.helpers.in_process import inputs_and_outputs, make_in_process
from tests.helpers.runs import COMPARED, SMALL, TINY, Tree, copied_tree, replaced, snakemake, tables

# Tables that put cases together and have a row, or a few, for each.
JOINT = ("errors", "linearisation", "methods", "models", "coverage", "mechanics", "contact_loss")
# What takes long before anything is judged.
_MADE = {"target", "measurement", "identification", "model_fits", "contact_loss"}
NEW_CASE = """  my_cell:
    sample: {model: liquid_drop, k: 20.0, k_p: 5.0, c: 8e1}
"""


def test_a_finished_study_has_nothing_to_do(tiny_copy: Path) -> None:
    run = snakemake(tiny_copy, "-n", config=TINY)
    assert "Nothing to be done" in run.output


def test_a_case_more_changes_no_number(finished_copy: Path) -> None:
    """Only tables that put cases together: with it, they are the same but for its rows."""
    before = tables(finished_copy)
    for name in JOINT:
        for file in (finished_copy / "results" / "tables").glob(f"{name}.*"):
            file.unlink()
    (finished_copy / DIFFERENCES.path).unlink()
    larger = study_of(SMALL + NEW_CASE)
    wanted = [file for file in inputs_and_outputs(larger)[1] if file.startswith(COMPARED)]
    make_in_process(finished_copy, larger, wanted)
    after = tables(finished_copy)
    joint = {f"tables/{name}" for name in JOINT}
    assert [
        name
        for name in before
        if before[name] != after[name] and name.rsplit(".", 1)[0] not in joint
    ] == []
    for name in joint:
        few, many = (told[f"{name}.csv"].splitlines() for told in (before, after))
        assert set(few) <= set(many)
        # The new case's jaws never pull, so that there is no contact to lose.
        assert (set(few) == set(many)) == (name == "tables/contact_loss")
    assert after["tables/errors.csv"].count(b"my_cell") == 3


def test_other_numbers_of_seeds_rerun_no_finished_job_and_change_no_number(
    tiny_copy: Path,
) -> None:
    """More, odd ones, and fewer."""
    target = "results/identifications/liquid_drop_2.csv"
    before = (tiny_copy / target).read_text().splitlines()
    larger = replaced(TINY, "batch_size: 1", "batch_size: 2")
    for seeds, fresh in ((3, 1), (6, 2), (1, 0)):
        run = snakemake(
            tiny_copy, target, config=replaced(larger, "\nseeds: 2", f"\nseeds: {seeds}")
        )
        assert run.status == 0, run.output
        done = run.jobs("target"), run.jobs("measurement"), run.jobs("identification")
        assert done == (0, fresh, 2 * fresh)
        after = (tiny_copy / target).read_text().splitlines()
        assert len(after) == 1 + 2 * seeds
        few, many = sorted((before, after), key=len)
        assert set(few) < set(many)
        before = after


@pytest.mark.parametrize(
    ("old", "new", "rerun"),
    [
        ("rate_Hz: 0.5", "rate_Hz: 2.0", {"target", "measurement", "identification"}),
        ("rate_Hz: 0.5", "rate_Hz: 0.5, noise: {level: 0.2}", {"measurement", "identification"}),
        ("\nseeds: 2", "\nseeds: 2\nevaluation: {near_noise_tolerance: 0.03}", set()),
    ],
)
def test_a_setting_reruns_what_depends_on_it(
    tiny_copy: Path, old: str, new: str, rerun: set[str]
) -> None:
    run = snakemake(tiny_copy, "-n", config=replaced(TINY, old, new))
    assert run.status == 0, run.output
    stages = {"target", "measurement", "identification"}
    assert {stage for stage in stages if run.jobs(stage)} == rerun
    assert run.jobs("errors") == 1


@pytest.mark.parametrize(
    ("old", "new", "spared"),
    [
        ("cases:\n", "cases:\n  liquid_drop_2: {title: A drop}\n", {*_MADE, "model_difference"}),
        (
            "cases:\n",
            "cases:\n  liquid_drop_2: {published: {generation: 62}}\n",
            {*_MADE, "model_difference", "judgement"},
        ),
        (
            "cases:\n",
            "search_range: {alpha: {exponent: [-2, 0]}}\ncases:\n",
            {*_MADE, "intervals", "judgement", "expectation"},
        ),
        (
            "cases:\n",
            "gripper: {uncertainty: {left: {stiffness_Nm_per_rad: 1.0e-9}}}\ncases:\n",
            {*_MADE, "expectation"},
        ),
        ("starts: 3", "starts: 4", {"target", "measurement", "expectation"}),
    ],
)
def test_a_setting_reruns_nothing_that_does_not_use_it(
    tiny_copy: Path, old: str, new: str, spared: set[str]
) -> None:
    run = snakemake(tiny_copy, "-n", config=replaced(TINY, old, new))
    assert run.status == 0, run.output
    assert not spared & set(run.all_jobs())
    assert run.jobs("report") == 1


def test_adding_a_case_plans_that_case_and_what_puts_cases_together(tiny_copy: Path) -> None:
    run = snakemake(tiny_copy, "-n", config=TINY + NEW_CASE)
    assert run.status == 0, run.output
    together = {"errors", "tables", "model_difference", "study_figures", "contact_loss"}
    together |= {"claims", "report"}
    jobs = run.all_jobs()
    assert together <= set(jobs)
    assert {rule: jobs.pop(rule) for rule in together} == dict.fromkeys(together, 1)
    # Two batches of seeds, two methods; what is left is done once for the case.
    batches = {"measurement": 2, "identification": 4, "model_fits": 2, "intervals": 2}
    assert {rule: jobs.pop(rule) for rule in batches} == batches
    joined = {"identifications", "joined"}
    once = {"target", "judgement", "expectation", "errors_of_case", "verdicts", "case_figures"}
    assert jobs == dict.fromkeys(joined | once, 1)


def test_a_setting_of_the_genetic_algorithm_leaves_other_methods_alone(tiny_copy: Path) -> None:
    run = snakemake(tiny_copy, "-n", config=replaced(TINY, "population: 20", "population: 22"))
    assert run.status == 0, run.output
    assert (run.jobs("identification"), run.jobs("errors")) == (2, 1)
    assert not {"target", "measurement", "model_fits", "intervals"} & set(run.all_jobs())
    assert run.output.count(" by genetic, ") == run.output.count("Identifying ") == 2


@pytest.fixture(scope="module")
def tree(tiny: Path, tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """A copy of the repository, and the study finished as if by it."""
    copied = copied_tree(tmp_path_factory.mktemp("tree"))
    shutil.copytree(tiny, copied.study)
    assert copied.run("--touch", config=TINY).status == 0
    return copied


@pytest.mark.parametrize(
    ("file", "jobs"),
    [
        ("src/biogrip/figures/scatter.py", {"case_figures": 1, "report": 1}),
        ("src/biogrip/tables/models.py", {"tables": 1, "claims": 1, "report": 1}),
    ],
)
def test_an_edit_reruns_exactly_what_it_is_used_in(
    tree: Tree, file: str, jobs: dict[str, int]
) -> None:
    with edited(tree.root / file):
        run = tree.run("-n", config=TINY)
    assert run.status == 0, run.output
    assert run.all_jobs() == jobs


def test_an_edited_caption_reruns_nothing(tree: Tree) -> None:
    with edited(tree.root / "workflow/report/product.rst"):
        run = tree.run("-n", config=TINY)
    assert run.status == 0, run.output
    assert "Nothing to be done" in run.output


def test_an_edited_method_reruns_its_identifications_and_what_follows(tree: Tree) -> None:
    with edited(tree.root / "src/biogrip/fit/genetic.py"):
        run = tree.run("-n", config=TINY)
    jobs = run.all_jobs()
    assert (jobs["identification"], jobs["identifications"], jobs["errors_of_case"]) == (2, 1, 1)
    untouched = {"target", "measurement", "judgement", "expectation", "model_fits", "intervals"}
    untouched |= {"model_difference"}
    assert not untouched & set(jobs)


ONE_METHOD_MORE = """
METHODS["another"] = Method("another", "another one", {}, "step", "amber", ":")
"""
ONE_MODEL_MORE = """
from dataclasses import replace
MODELS["another"] = replace(LIQUID_DROP, name="another")
"""


def test_a_method_and_a_model_more_rerun_nothing(tree: Tree) -> None:
    package = tree.root / "src" / "biogrip"
    with (
        edited(package / "identify" / "methods.py", ONE_METHOD_MORE),
        edited(package / "experiment" / "models.py", ONE_MODEL_MORE),
    ):
        run = tree.run("-n", config=TINY)
    assert run.status == 0, run.output
    assert "Nothing to be done" in run.output


def test_a_method_said_otherwise_reruns_what_says_it(tree: Tree) -> None:
    """Least squares is drawn and listed, but not what it found."""
    said = '\nMETHODS["least_squares"] = replace(METHODS["least_squares"], title="fits")\n'
    file = tree.root / "src/biogrip/fit/methods.py"
    with edited(file, f"\nfrom dataclasses import replace\n{said}"):
        run = tree.run("-n", config=TINY)
    drawn = {"study_figures": 1, "case_figures": 1}
    assert run.all_jobs() == {"tables": 1, "claims": 1, **drawn, "report": 1}


def test_an_edited_model_reruns_what_it_is_used_in(tree: Tree) -> None:
    """The study's are of one family; a fluid that it does not name is of another."""
    package = tree.root / "src" / "biogrip" / "experiment"
    for file in ("burgers.py", "fractional.py"):
        with edited(package / file):
            run = tree.run("-n", config=TINY)
        assert "Nothing to be done" in run.output
    with edited(package / "maxwell_models.py"):
        run = tree.run("-n", config=TINY)
    used_in = {"target", "identification", "model_fits", "intervals", "judgement"}
    assert used_in | {"model_difference", "report"} <= set(run.all_jobs())
    with edited(package / "burgers.py"):
        named = replaced(TINY, "damper, maxwell", "damper, burgers")
        jobs = tree.run("-n", config=named).all_jobs()
    assert "model_fits" in jobs
    assert not {"target", "identification", "intervals", "judgement"} & set(jobs)


@contextmanager
def edited(file: Path, line: str = "\n# edited\n") -> Iterator[None]:
    """Add a line to a file for a while, and put its time back with its content."""
    content, times = file.read_text(), file.stat()
    file.write_text(content + line)
    yield
    file.write_text(content)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
