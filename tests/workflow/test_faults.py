"""Runs that are killed end with the undisturbed bytes when run again."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, results_of, snakemake

pytestmark = pytest.mark.nightly

# What is asked for, and what is removed so that there is something to do.
ERRORS = "results/tables/errors_liquid_drop_2.csv"
AGAIN = [ERRORS, "results/tables/methods.csv"]
_REMOVED = ("identifications", "histories", "timings")


def started(folder: Path) -> "subprocess.Popen[bytes]":
    """Start a run of Snakemake, and do not wait for it."""
    for stage in _REMOVED:
        shutil.rmtree(folder / "results" / stage / "liquid_drop_2")
    for file in (ERRORS, "results/identifications/liquid_drop_2.csv"):
        (folder / file).unlink()
    command = [sys.executable, "-m", "snakemake", "-j1", "-s", str(ROOT / "Snakefile")]
    command += ["--directory", str(folder), "--configfile", str(folder / "overlay.yaml")]
    return subprocess.Popen(
        [*command, "--", ERRORS],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        # By which its jobs are found.
        process_group=0,
    )


def wait_for(found: Callable[[], object], process: "subprocess.Popen[bytes]") -> None:
    """Wait until there is something, while a process runs."""
    give_up = time.monotonic() + 120
    while not found():
        assert time.monotonic() < give_up
        assert process.poll() is None
        time.sleep(0.02)


def jobs_below(parent: int) -> list[int]:
    """Return the processes of scripts of a run."""
    listed = subprocess.check_output(["ps", "-ww", "-eo", "pid=,pgid=,args="], text=True)
    rows = [line.split(maxsplit=2) for line in listed.splitlines()]
    return [
        int(pid)
        for pid, group, command in rows
        if int(group) == parent and "identification.py" in command and " -c" not in command
    ]


def kill_a_job(process: "subprocess.Popen[bytes]", folder: Path) -> None:
    """Kill -9 of an identification."""
    wait_for(lambda: jobs_below(process.pid), process)
    for job in jobs_below(process.pid):
        os.kill(job, signal.SIGKILL)
    assert process.wait(120) != 0


def kill_snakemake(process: "subprocess.Popen[bytes]", folder: Path) -> None:
    """Kill -9 of Snakemake when there is a result; it asks to be unlocked."""
    wait_for(lambda: [*folder.glob("results/identifications/liquid_drop_2/*/*.csv")], process)
    process.kill()
    process.wait()
    again = snakemake(folder, "--", ERRORS, config=TINY)
    assert again.status == 1
    assert "--unlock" in again.output
    assert snakemake(folder, "--unlock", config=TINY).status == 0


@pytest.mark.parametrize("fault", [kill_snakemake, kill_a_job])
def test_the_same_command_ends_with_the_undisturbed_bytes(
    tiny: Path, tiny_copy: Path, fault: Callable[["subprocess.Popen[bytes]", Path], None]
) -> None:
    fault(started(tiny_copy), tiny_copy)
    run = snakemake(tiny_copy, "--", *AGAIN, config=TINY)
    assert run.status == 0, run.output
    ours, theirs = results_of(tiny_copy), results_of(tiny)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
