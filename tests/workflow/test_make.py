"""A job's command typed by hand: its settings are among the results, and it says what is wrong."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from biogrip.products.catalogue import products
from biogrip.products.digest import modules_in
from biogrip.products.source_files import source_files

from biogrip.cli import main
from tests.helpers.default import study_of
from tests.helpers.runs import TINY, biogrip, built_once, results_of

CASE = ("--case", "liquid_drop_2")
BATCH = (*CASE, "--batch", "seeds_1-1")
METHOD = ("--method", "least_squares")

# Every module of ours whose functions run while a product is made, in a process for each: what
# is kept from one job to the next would not be called again.
WATCHED = """
import cProfile, gc, json, os, sys
from pathlib import Path
import pandas, pyarrow.parquet, scipy.interpolate
import matplotlib.backends.backend_agg, matplotlib.backends.backend_pdf
import biogrip
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.resolved import read_study
package = str(Path(biogrip.__file__).parent)
plan = Plan(read_study(Path("results")), Path("results"))
def seen_by(name, job):
    profile = cProfile.Profile()
    product = products()[name]
    make = product.make
    def watched(*given, **files):
        profile.enable()
        make(*given, **files)
        profile.disable()
    object.__setattr__(product, "make", watched)
    product.run(plan, job)
    # Modules are imported on the way; only what is called counts.
    called = {
        entry.code.co_filename
        for entry in profile.getstats()
        if not isinstance(entry.code, str) and entry.code.co_name != "<module>"
    }
    return sorted(file for file in called if file.startswith(package))
# What is loaded before is not profiled while it is.
products()
gc.freeze()
for name, job in json.load(sys.stdin):
    if child := os.fork():
        assert os.waitpid(child, 0)[1] == 0, name
    else:
        print(json.dumps([name, seen_by(name, job)]), flush=True)
        os._exit(0)
"""
JOBS = {
    "target": CASE,
    "measurement": BATCH,
    "identification": (*BATCH, *METHOD),
    "identifications": CASE,
    "intervals": (*CASE, "--batch", "seeds_1-1"),
    "model_fits": BATCH,
    "expectation": CASE,
    "judgement": CASE,
    "errors_of_case": CASE,
    "methods": (),
    "sampling_evidence": (),
    "fit": CASE,
    "scatter": CASE,
    "torque": (),
    "overview": (),
    "summary": CASE,
}


def wildcards_of(job: tuple[str, ...]) -> dict[str, str]:
    pairs = zip(job[::2], job[1::2], strict=True)
    return {key.removeprefix("--"): text for key, text in pairs}


KINDS = ("csv", "md", "tex")


@pytest.mark.parametrize(
    ("names", "job", "files"),
    [
        (("errors_of_case",), CASE, [f"tables/errors_liquid_drop_2.{kind}" for kind in KINDS]),
        (("target",), CASE, ["targets/liquid_drop_2.csv"]),
        (("measurement",), BATCH, ["measurements/liquid_drop_2/seeds_1-1.parquet"]),
        (
            ("identification",),
            (*BATCH, *METHOD),
            [
                "identifications/liquid_drop_2/least_squares/seeds_1-1.csv",
                "histories/liquid_drop_2/least_squares/seeds_1-1.parquet",
            ],
        ),
        (("methods", "models"), (), ["tables/methods.csv", "tables/models.tex"]),
        (("fit", "scatter"), CASE, ["figures/fit_liquid_drop_2.pdf"]),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_what_was_deleted_is_made_again_as_it_was(
    tiny: Path,
    tiny_copy: Path,
    monkeypatch: pytest.MonkeyPatch,
    names: tuple[str, ...],
    job: tuple[str, ...],
    files: list[str],
) -> None:
    monkeypatch.chdir(tiny_copy)
    for file in files:
        (tiny_copy / "results" / file).unlink()
    assert main(["make", *names, *job]) == 0
    assert results_of(tiny_copy) == results_of(tiny)
    # And the record knows it; what is told of times, it knows too, is of another identification.
    assert main(["verify"]) == ("identification" in names)


def test_a_batch_of_another_plan_is_made(tiny_copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that a larger study left, and that runs again as its code has changed."""
    monkeypatch.chdir(tiny_copy)
    both = (*CASE, "--batch", "seeds_0-1")
    assert main(["make", "measurement", *both]) == 0
    assert main(["make", "identification", *both, *METHOD]) == 0
    folder = tiny_copy / "results" / "identifications" / "liquid_drop_2" / "least_squares"
    rows = [(folder / f"seeds_{seeds}.csv").read_text().splitlines() for seeds in ("0-0", "1-1")]
    assert (folder / "seeds_0-1.csv").read_text().splitlines() == [*rows[0], *rows[1][1:]]


@pytest.mark.nightly
def test_a_command_is_typed_in_a_shell(tiny: Path, tiny_copy: Path) -> None:
    """As all tests here but in a process of its own."""
    (tiny_copy / "results" / "tables" / "errors_liquid_drop_2.csv").unlink()
    done = biogrip(tiny_copy, "make", "errors_of_case", *CASE)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert results_of(tiny_copy) == results_of(tiny)
    done = biogrip(tiny_copy, "make", "erors", *CASE)
    assert done.returncode == 1
    assert done.stderr.startswith("biogrip: no product 'erors'. Did you mean 'errors'? Allowed: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("erors", *CASE), "no product 'erors'. Did you mean 'errors'? Allowed: "),
        (("errors_of_case",), "errors_of_case: is made with --case, which is missing."),
        (
            ("identification", *CASE, *METHOD, "--batch", "seeds_0-24"),
            "--batch: found 'seeds_0-24'. Did you mean 'seeds_0-0'? Allowed: seeds_0-0, seeds_1-1.",
        ),
        (
            ("errors_of_case", "--case", "liquid_drop_3"),
            "--case: found 'liquid_drop_3'. Did you mean 'liquid_drop_2'? Allowed: liquid_drop_2.",
        ),
        (("errors_of_case", *BATCH), "--batch: does not go with errors_of_case."),
        (("methods", *CASE), "--case: does not go with methods."),
        (("measurement", *CASE), "measurement: is made with --batch, which is missing."),
        (
            ("measurement", *CASE, "--batch", "0-1"),
            "--batch: found '0-1', allowed is seeds_FIRST-LAST.",
        ),
        (
            ("identification", *BATCH, "--method", "genetics"),
            "--method: found 'genetics'. Did you mean 'genetic'? Allowed: least_squares, genetic.",
        ),
        (("single_trace", *CASE, "--seed", "x"), "--seed: found 'x', allowed is a number."),
        (("robustness", "--sweep", "noise"), "--sweep: found 'noise'."),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_cannot_be_made_is_said_and_changes_nothing(
    tiny: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tiny)
    before = results_of(tiny)
    assert main(["make", *arguments]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"biogrip: {message}")
    assert said.count("\n") == 1
    assert results_of(tiny) == before


def test_a_folder_without_a_study_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["make", "errors_of_case", *CASE]) == 1
    said = capsys.readouterr().err
    assert said.startswith("biogrip: results/study.json: there is none, as no study was run here")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["", "[", "{}", "[]", '"study"', '{"cases": 3}'])
def test_a_damaged_study_is_said(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    text: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "study.json").write_text(text)
    assert main(["make", "errors_of_case", *CASE]) == 1
    said = capsys.readouterr().err
    assert said.startswith("biogrip: results/study.json: cannot be read as a study")
    assert said.count("\n") == 1


def test_a_file_of_the_users_is_not_replaced(
    tiny_copy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tiny_copy)
    mine = tiny_copy / "results" / "traces" / "liquid_drop_2" / "seed_0.csv"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert main(["make", "single_trace", *CASE, "--seed", "0"]) == 1
    assert "seed_0.csv: in the way, and not written by this study" in capsys.readouterr().err
    assert mine.read_text() == "mine"


@pytest.fixture(scope="module")
def called(
    tiny: Path, tmp_path_factory: pytest.TempPathFactory, worker_id: str
) -> dict[str, set[str]]:
    """By product, the files of all functions that are called when it is made."""

    def watch(folder: Path) -> None:
        study = shutil.copytree(tiny, folder / "study")
        jobs = [(name, wildcards_of(job)) for name, job in JOBS.items()]
        done = subprocess.run(
            [sys.executable, "-c", WATCHED],
            cwd=study,
            input=json.dumps(jobs),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        (folder / "called").write_text(done.stdout)

    said = (built_once("watch_writes", watch, tmp_path_factory, worker_id) / "called").read_text()
    lines = [line for line in said.splitlines() if line.startswith("[")]
    return {name: set(files) for name, files in map(json.loads, lines)}


@pytest.mark.parametrize("name", JOBS)
@pytest.mark.nightly
def test_no_code_that_makes_a_product_is_missing_from_its_digest(
    called: dict[str, set[str]], name: str
) -> None:
    """What is called is the independent count; what only says what to do is in the settings."""
    product = products()[name]
    job = wildcards_of(JOBS[name])
    in_settings = modules_in(product.settings(study_of(TINY), job))
    known = source_files(product.module, *product.modules(job), *in_settings)
    # How a product is written down when it is made, not what: see `_SAYING`.
    wrappers = {file for file in called[name] if file.endswith("/declared.py")}
    assert sys.modules[product.module].__file__ in called[name]
    assert called[name] - wrappers <= set(known)


def test_a_study_is_written_down_as_it_was_run(tiny: Path) -> None:
    told = json.loads((tiny / "results" / "study.json").read_text())
    assert list(told["cases"]) == ["liquid_drop_2"]
    assert told["seeds"] == 2
