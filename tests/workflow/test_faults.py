"""Bad input and broken runs: one clear message, and nothing lost."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.workflow.conftest import ROOT, SMALL, snakemake, tables

BAD = {
    "misspelt key": ("seedz: 3", "overlay.yaml, line 1: seedz: unknown key. Did you mean 'seeds'?"),
    "wrong type": (
        "seeds: many",
        "overlay.yaml, line 1: seeds: found 'many', allowed is an integer",
    ),
    "negative stiffness": (
        "gripper: {left: {stiffness_Nm_per_rad: -1}}",
        "gripper.left.stiffness_Nm_per_rad: found -1, allowed is greater than 0 N m/rad",
    ),
    "case with a slash": (
        "cases: {a/b: {sample: {model: liquid_drop, k: 1, k_p: 1, c: 1}}}",
        "cases.a/b: not a usable case name",
    ),
    "unknown model": (
        "cases: {x: {sample: {model: maxwel, k: 1, k_p: 1, c: 1}}}",
        "found 'maxwel'. Did you mean 'maxwell'? Allowed: generalized_maxwell, liquid_drop",
    ),
    "zero seeds": ("seeds: 0", "seeds: found 0, allowed is at least 1"),
    "ends before it starts": (
        "protocol: {phases: [{duration_s: -200, torque_Nm: 1e-9}]}",
        "protocol.phases[0].duration_s: found -200, allowed is greater than 0 s",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_config_stops_with_one_message(finished: Path, tmp_path: Path, name: str) -> None:
    study = tmp_path / "study"
    shutil.copytree(finished, study)
    before = tables(study)
    config, message = BAD[name]
    run = snakemake(study, config=config)
    assert run.status != 0
    assert message in run.output
    assert "Traceback" not in run.output
    assert run.output.count("\n") <= 25
    assert tables(study) == before


def test_results_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("in the way")
    run = snakemake(tmp_path)
    assert run.status != 0
    assert "results: results cannot be written here" in run.output
    assert "Traceback" not in run.output
    assert run.output.count("\n") <= 25


def test_a_damaged_target_is_named(finished: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    shutil.copytree(finished, study)
    target = study / "results/targets/endothelial_cell.csv"
    target.write_text("time,angle\n1,2\n")
    for file in (study / "results/measurements/endothelial_cell").iterdir():
        file.unlink()
    run = snakemake(study, "results/measurements/endothelial_cell/seeds_0-1.parquet")
    assert run.status != 0
    assert "endothelial_cell.csv, line 1: found the columns time, angle" in run.output
    assert "Traceback" not in run.output


def test_a_killed_run_continues_with_the_same_command(finished: Path, tmp_path: Path) -> None:
    """Kill -9 of Snakemake in mid-run: the second call needs no other flag."""
    (tmp_path / "overlay.yaml").write_text(SMALL)
    command = [sys.executable, "-m", "snakemake", "-j2", "--snakefile", str(ROOT / "Snakefile")]
    command += ["--directory", str(tmp_path), "--configfile", str(tmp_path / "overlay.yaml")]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT
    )
    give_up = time.monotonic() + 120
    while len(list((tmp_path / "results").glob("identifications/*/*/*.csv"))) < 3:
        assert time.monotonic() < give_up
        assert process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert list((tmp_path / ".snakemake" / "locks").iterdir())
    run = snakemake(tmp_path)
    assert run.status == 0, run.output
    assert 0 < run.jobs("identification") < 4
    assert tables(tmp_path) == tables(finished)


def test_a_difference_is_shown_and_fails(finished: Path, tmp_path: Path) -> None:
    """The comparison behind the check, on one changed cell and one missing table."""
    published = tmp_path / "published"
    shutil.copytree(finished / "results" / "tables", published)
    errors = published / "errors.csv"
    old = errors.read_text().splitlines()
    cells = old[2].split(",")
    cells[7] = "99.9"
    errors.write_text("\n".join([*old[:2], ",".join(cells), *old[3:], ""]))
    (published / "gripper.md").unlink()
    command = [sys.executable, "-m", "biogrip", "compare", str(published)]
    now = str(finished / "results" / "tables")
    done = subprocess.run([*command, now], capture_output=True, text=True)
    assert done.returncode != 0
    assert "gripper.md: regenerated, but not published" in done.stderr
    row = next(line for line in done.stderr.splitlines() if "99.9" in line)
    for word in ("errors", "endothelial_cell k_p", "best_identified", "99.9"):
        assert word in row
    same = subprocess.run(
        [sys.executable, "-m", "biogrip", "compare", now, now], capture_output=True, text=True
    )
    assert same.returncode == 0
    assert "byte for byte" in same.stdout
