"""A job's command typed by hand: its settings are among the results, and it says what is wrong."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from biogrip.products.catalogue import products
from biogrip.running.source_files import source_files
from tests.workflow.conftest import results_of

CASE = ("--case", "liquid_drop_2")
BATCH = (*CASE, "--batch", "seeds_1-1")
METHOD = ("--method", "least_squares")

# Every module of ours whose functions run while a product is made.
WATCHED = """
import sys
from pathlib import Path
import biogrip
from biogrip.products.catalogue import chosen
from biogrip.products.plan import Plan
from biogrip.running.resolved import read_study
package = str(Path(biogrip.__file__).parent)
name, job = sys.argv[1], dict(zip(sys.argv[2::2], sys.argv[3::2]))
seen = set()
def watch(frame, event, argument):
    code = frame.f_code
    # Modules are imported on the way; only what is called counts.
    if event == "call" and code.co_filename.startswith(package) and code.co_name != "<module>":
        seen.add(code.co_filename)
(product,) = chosen([name])
make = product.make
def watched(*given, **files):
    sys.setprofile(watch)
    make(*given, **files)
    sys.setprofile(None)
object.__setattr__(product, "make", watched)
plan = Plan(read_study(Path("results")), Path("results"))
job = {key.removeprefix("--"): value for key, value in job.items()}
product.run(plan, job)
print(*sorted(seen), sep="\\n")
"""


@pytest.fixture
def study(tiny: Path, tmp_path: Path) -> Path:
    copied = tmp_path / "study"
    shutil.copytree(tiny, copied)
    return copied


def biogrip(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "biogrip", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    ("names", "job", "files"),
    [
        (("errors",), CASE, [f"tables/errors_liquid_drop_2.{k}" for k in ("csv", "md", "tex")]),
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
    tiny: Path, study: Path, names: tuple[str, ...], job: tuple[str, ...], files: list[str]
) -> None:
    for file in files:
        (study / "results" / file).unlink()
    done = biogrip(study, "make", *names, *job)
    assert done.returncode == 0, done.stderr
    assert results_of(study) == results_of(tiny)
    # And the record knows it.
    assert biogrip(study, "verify").returncode == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("erors", *CASE), "no product 'erors'. Did you mean 'errors'? Allowed: "),
        (("errors",), "errors: is made with --case, which is missing."),
        (
            ("errors", "--case", "liquid_drop_3"),
            "--case: found 'liquid_drop_3'. Did you mean 'liquid_drop_2'? Allowed: liquid_drop_2.",
        ),
        (("errors", *BATCH), "--batch: does not go with errors."),
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
    tiny: Path, arguments: tuple[str, ...], message: str
) -> None:
    before = results_of(tiny)
    done = biogrip(tiny, "make", *arguments)
    assert done.returncode == 1
    assert done.stderr.startswith(f"biogrip: {message}")
    assert done.stderr.count("\n") == 1
    assert results_of(tiny) == before


def test_a_folder_without_a_study_is_said(tmp_path: Path) -> None:
    done = biogrip(tmp_path, "make", "errors", *CASE)
    assert done.returncode == 1
    assert done.stderr.startswith("biogrip: results/study.json: there is none, for no study was ru")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["", "[", "{}", "[]", '"study"', '{"cases": 3}'])
def test_a_damaged_study_is_said(tmp_path: Path, text: str) -> None:
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "study.json").write_text(text)
    done = biogrip(tmp_path, "make", "errors", *CASE)
    assert done.returncode == 1
    assert done.stderr.startswith("biogrip: results/study.json: cannot be read as a study")
    assert "Traceback" not in done.stderr


def test_a_file_of_the_users_is_not_replaced(study: Path) -> None:
    mine = study / "results" / "traces" / "liquid_drop_2" / "seed_0.csv"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    done = biogrip(study, "make", "single_trace", *CASE, "--seed", "0")
    assert done.returncode == 1
    assert "seed_0.csv: in the way, and not written by this study" in done.stderr
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "job"),
    [
        ("target", CASE),
        ("measurement", BATCH),
        ("identification", (*BATCH, *METHOD)),
        ("identifications", CASE),
        ("intervals", (*CASE, "--batch", "seeds_1-1")),
        ("model_fits", BATCH),
        ("expectation", CASE),
        ("judgement", CASE),
        ("errors", CASE),
        ("methods", ()),
        ("sampling_evidence", ()),
        ("fit", CASE),
        ("scatter", CASE),
        ("torque", ()),
        ("overview", ()),
        ("summary", CASE),
    ],
)
def test_no_code_that_makes_a_product_is_missing_from_its_digest(
    study: Path, name: str, job: tuple[str, ...]
) -> None:
    """What is called is the independent count; what only says what to do is in the settings."""
    command = [sys.executable, "-c", WATCHED, name, *job]
    done = subprocess.run(
        command, cwd=study, env=os.environ, capture_output=True, text=True, check=True
    )
    wildcards = {
        key.removeprefix("--"): text for key, text in zip(job[::2], job[1::2], strict=True)
    }
    product = products()[name]
    known = set(source_files(product.module, *product.modules(wildcards)))
    # How a product is written down when it is made, not what: see `_SAYING`.
    wrappers = {str(Path(file)) for file in done.stdout.split() if file.endswith("/declared.py")}
    assert set(done.stdout.split()) - wrappers <= known


def test_a_study_is_written_down_as_it_was_run(tiny: Path) -> None:
    told = json.loads((tiny / "results" / "study.json").read_text())
    assert list(told["cases"]) == ["liquid_drop_2"]
    assert told["seeds"] == 2
