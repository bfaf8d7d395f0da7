"""What the workflow on the usual host lets a pull request do, and what `.ci/run` needs root for."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.helpers.places import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").iterdir())
NEEDED = ("munged", "slurmctld", "slurmd", "srun", "chromium")
each_workflow = pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)


def steps(workflow: Path) -> list[dict[str, Any]]:
    jobs = yaml.safe_load(workflow.read_text(encoding="utf-8"))["jobs"].values()
    return [step for job in jobs for step in job["steps"]]


@each_workflow
def test_actions_are_pinned_to_commits(workflow: Path) -> None:
    """And say which version that is: only a commit cannot be moved."""
    used = re.findall(r"\buses:(.*)", workflow.read_text(encoding="utf-8"))
    assert len(used) == sum("uses" in step for step in steps(workflow)) > 0
    pinned = re.compile(r" [\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")
    assert [action for action in used if not pinned.fullmatch(action)] == []


@each_workflow
def test_nothing_is_permitted_but_reading(workflow: Path) -> None:
    """Neither to the whole nor to a job, nor by what a checkout would leave behind."""
    told = yaml.safe_load(workflow.read_text(encoding="utf-8"))
    assert told["permissions"] == {"contents": "read"}
    for job in told["jobs"].values():
        assert job.get("permissions", {}) in ({}, {"contents": "read"})
    # YAML takes the key `on` for a truth.
    assert "pull_request_target" not in told[True]
    for step in steps(workflow):
        if str(step.get("uses")).startswith("actions/checkout@"):
            assert step["with"] == {"persist-credentials": False}


@each_workflow
def test_root_only_installs_packages_by_name(workflow: Path) -> None:
    commands = [
        line for step in steps(workflow) for line in str(step.get("run", "")).splitlines() if line
    ]
    allowed = re.compile(r"sudo apt-get (update|install)( -{1,2}[\w-]+)*( [a-z][a-z0-9-]*)*")
    as_root = [command for command in commands if "sudo" in command]
    assert [command for command in as_root if not allowed.fullmatch(command)] == []
    # What is not as root cannot become it, either.
    others = [command for command in commands if command not in as_root]
    assert [
        command for command in others if not command.startswith("setpriv --no-new-privs ")
    ] == []


@pytest.fixture
def calls(tmp_path: Path) -> Path:
    """A repository of nothing but `.ci/run`, beside programs that only write down their calls."""
    shutil.copytree(ROOT / ".ci", tmp_path / ".ci")
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("make", "apt-get", *NEEDED):
        (programs / name).write_text(f'#!/bin/sh\necho "{name} $*" >> {tmp_path}/calls\n')
        (programs / name).chmod(0o755)
    dirname = shutil.which("dirname")
    assert dirname
    (programs / "dirname").symlink_to(dirname)
    return tmp_path / "calls"


def run_ci(calls: Path) -> tuple[int, list[str]]:
    bash = shutil.which("bash")
    assert bash
    command = [bash, str(calls.parent / ".ci" / "run")]
    done = subprocess.run(command, env={"PATH": str(calls.parent / "bin")}, capture_output=True)
    return done.returncode, calls.read_text().splitlines()


def test_nothing_is_installed_where_everything_is_there(calls: Path) -> None:
    """So that an ordinary user can run it."""
    status, called = run_ci(calls)
    assert status == 0
    assert {call.split()[0] for call in called} == {"make"}
    assert len(called) == 5


def test_what_is_missing_is_installed(calls: Path) -> None:
    (calls.parent / "bin" / "chromium").unlink()
    status, called = run_ci(calls)
    assert status == 0
    assert called[0].startswith("apt-get update")
    assert called[1].startswith("apt-get install")
    assert called[1].split()[-1] == "chromium"
    assert len(called) == 7


def test_what_cannot_be_installed_ends_the_run(calls: Path) -> None:
    (calls.parent / "bin" / "chromium").unlink()
    (calls.parent / "bin" / "apt-get").write_text(f"#!/bin/sh\necho denied >> {calls}\nexit 100\n")
    assert run_ci(calls) == (1, ["denied"])
