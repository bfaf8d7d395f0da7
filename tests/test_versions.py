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
    installed = re.findall(r"pip install (.*)", (ROOT / "Makefile").read_text(encoding="utf-8"))
    ourselves = "--no-deps --no-build-isolation -e ."
    others = [arguments for arguments in installed if ourselves not in arguments]
    assert len(others) > 3
    assert [arguments for arguments in others if "--require-hashes -r " not in arguments] == []


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
