"""The versions that are allowed, locked and tried: what the files that name them say together."""

import os
import re
import subprocess
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest

from tests.helpers.places import ROOT

LOCKS = sorted(
    (*ROOT.glob("*.lock"), *(ROOT / "benchmarks").rglob("*.lock"), *(ROOT / "docs").glob("*.lock"))
)
OLDEST = ROOT / "requirements-lowest.lock"
PINNED = re.compile(r"^([\w.-]+)==([^ ]+)")


def version_of(text: str) -> tuple[int, ...]:
    """Its numbers; 6.0 is 6.0.0."""
    numbers = [int(number) for number in text.split(".")]
    return (*numbers, *[0] * (4 - len(numbers)))


def lower_bounds() -> dict[str, str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *extras["dev"], *extras["bench"]]
    bounds = dict(requirement.split(">=") for requirement in asked)
    return {name.split("[")[0].lower(): bound for name, bound in bounds.items()}


def test_the_oldest_versions_allowed_are_those_tried() -> None:
    """If this fails: make lock, and if it goes on: a bound below the first version that can be."""
    locked = defaultdict(set)
    for line in OLDEST.read_text(encoding="utf-8").splitlines():
        if found := PINNED.match(line):
            locked[found[1].lower()].add(version_of(found[2]))
    # For a newer Python some other library may ask for more.
    bounds = {name: version_of(bound) for name, bound in lower_bounds().items()}
    assert {name: min(locked[name]) for name in bounds} == bounds


def test_the_workflow_asks_for_the_snakemake_that_the_package_asks_for() -> None:
    asked = re.findall(r'^min_version\("(.*)"\)$', (ROOT / "Snakefile").read_text(), re.MULTILINE)
    assert asked == [lower_bounds()["snakemake"]]


@pytest.mark.parametrize("lock", LOCKS, ids=lambda path: str(path.relative_to(ROOT)))
def test_locks_hold_hashes_and_no_addresses(lock: Path) -> None:
    text = lock.read_text(encoding="utf-8")
    entries = re.split(r"\n(?! )", text.strip())
    assert [entry for entry in entries if not PINNED.match(entry)] == []
    assert [entry for entry in entries if "--hash=sha256:" not in entry] == []
    assert "://" not in text


def test_nothing_is_installed_that_is_not_locked() -> None:
    """By pip only what brings uv and builds ourselves; by uv only what locks hold."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n", "")
    installed = re.findall(r"(\w+) pip install ([^&\n]*)|-m pip install ([^&\n]*)", makefile)
    by_uv = [arguments for program, arguments, _ in installed if program == "uv"]
    by_pip = [" ".join(arguments.split()) for _, _, arguments in installed if arguments]
    assert by_pip == [
        "--quiet --require-hashes -r requirements-install.lock",
        "--quiet --no-deps --no-build-isolation -e .",
    ]
    assert [arguments for arguments in by_uv if "--require-hashes" not in arguments] == []
    assert len(by_uv) == len(installed) - 2 == 1
    locks = re.findall(r"^\t.*\$\(call locked,[^,]+,([^)]+)\)", makefile, re.MULTILINE)
    assert {lock for group in locks for lock in group.split()} == {
        str(lock.relative_to(ROOT))
        for lock in LOCKS
        if lock.name not in ("requirements-install.lock", "requirements-slurm.lock")
    }


def pinned_in(*names: str) -> dict[str, set[str]]:
    """The versions that locks name, by library."""
    found = defaultdict(set)
    for name in names:
        for line in (ROOT / name).read_text(encoding="utf-8").splitlines():
            if pin := PINNED.match(line):
                found[pin[1]].add(pin[2])
    return found


def test_what_tests_need_is_locked_beside_what_a_study_needs() -> None:
    """Neither holds what the other does, and none installs in its own version."""
    study, dev = pinned_in("requirements.lock"), pinned_in("requirements-dev.lock")
    assert {"numpy", "snakemake"} <= set(study)
    assert {"pytest", "mypy", "playwright"} <= set(dev)
    assert set(study) & set(dev) == set()
    both = {**study, **dev}
    installing = pinned_in("requirements-install.lock")
    assert {"uv", "hatchling", "editables"} <= set(installing)
    assert {name: both[name] for name in installing if name in both} == {
        name: versions for name, versions in installing.items() if name in both
    }


def test_the_readme_counts_the_packages_that_are_installed() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    study, dev = pinned_in("requirements.lock"), pinned_in("requirements-dev.lock")
    assert f"installs {len(study)} locked packages" in readme
    assert f"installs {len(dev)} more, " in readme


# In place of a Python: makes environments with itself in them, and has nothing to say.
STAND_IN = (
    '#!/bin/sh\ncase "$*" in "-m venv"*) mkdir -p "$4/bin" && cp "$0" "$4/bin/python" ;; esac\n'
)
ABSENT = "#!/bin/sh\nexit 127\n"


@pytest.mark.parametrize(
    ("there", "status", "said"),
    [
        ((), 2, "nothing ran"),
        (("3.13",), 0, "ran with Python 3.13"),
        (("3.12", "3.13"), 0, "ran with Python 3.12 3.13"),
    ],
    ids=lambda value: "-".join(value) or "none" if isinstance(value, tuple) else None,
)
def test_which_pythons_were_tried_is_said(
    tmp_path: Path, there: tuple[str, ...], status: int, said: str
) -> None:
    """A check that checked nothing has failed."""
    known = ("3.12", "3.13")
    for version in known:
        program = tmp_path / f"python{version}"
        program.write_text(STAND_IN if version in there else ABSENT)
        program.chmod(0o755)
    done = subprocess.run(
        ["make", "--no-print-directory", "-f", str(ROOT / "Makefile"), "test-pythons"],
        cwd=tmp_path,
        env={**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}", "MAKEFLAGS": ""},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert done.returncode == status, done.stdout
    assert f"test-pythons: {said}" in done.stdout
    skipped = re.findall(r"^test-pythons: skipped Python ([\d.]+)", done.stdout, re.MULTILINE)
    assert skipped == [version for version in known if version not in there]
