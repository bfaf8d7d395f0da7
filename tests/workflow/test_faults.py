"""Bad input and broken runs: one clear message, and nothing lost."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import psutil
import pytest

from biogrip.errors import BiogripError
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from tests.helpers import loaded
from tests.helpers.places import CONFIG, ROOT
from tests.helpers.runs import TINY, biogrip, results_of, snakemake
from tests.helpers.runs import run as biogrip_run

BAD = {
    "misspelt key": ("seedz: 3", "overlay.yaml, line 1: seedz: unknown key. Did you mean 'seeds'?"),
    "wrong type": (
        "seeds: many",
        "overlay.yaml, line 1: seeds: found 'many', allowed is an integer",
    ),
    "negative stiffness": (
        "gripper: {left: {stiffness_Nm_per_rad: -1}}",
        "gripper.left.stiffness_Nm_per_rad: found -1, allowed is at least 1e-12 and at most 1000",
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
        "protocol.phases[0].duration_s: found -200, allowed is at least 1e-06 and at most 1e+09 s",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_config_is_named(tmp_path: Path, name: str) -> None:
    config, message = BAD[name]
    file = tmp_path / "overlay.yaml"
    file.write_text(config)
    with pytest.raises(BiogripError) as error:
        load_study(overlaid(read_config(CONFIG), read_config(file)), [CONFIG, file])
    assert message in str(error.value)


def test_a_bad_config_stops_with_one_message(tiny: Path, tiny_copy: Path) -> None:
    config, message = BAD["misspelt key"]
    run = snakemake(tiny_copy, config=config)
    assert run.status != 0
    assert message in run.output
    assert "Traceback" not in run.output
    assert run.output.count("\n") <= 25
    assert results_of(tiny_copy) == results_of(tiny)


def test_results_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("in the way")
    run = snakemake(tmp_path)
    assert run.status != 0
    assert "results: found a file, allowed is a folder" in run.output
    assert "Traceback" not in run.output
    assert run.output.count("\n") <= 25


@pytest.mark.nightly
def test_a_damaged_target_is_named_and_made_again(tiny: Path, tiny_copy: Path) -> None:
    target = tiny_copy / "results/targets/liquid_drop_2.csv"
    whole = target.read_bytes()
    target.write_text("time,angle\n1,2\n")
    batch = tiny_copy / "results/measurements/liquid_drop_2/seeds_0-0.parquet"
    batch.unlink()
    # By a job's command alone nothing is made again.
    done = biogrip(
        tiny_copy, "make", "measurement", "--case", "liquid_drop_2", "--batch", "seeds_0-0"
    )
    assert done.returncode == 1
    assert "liquid_drop_2.csv, line 1: found the columns time, angle" in done.stderr
    assert "Traceback" not in done.stderr
    run = biogrip_run(tiny_copy, str(batch.relative_to(tiny_copy)), config=TINY)
    assert run.status == 0, run.output
    kept = "results/targets/liquid_drop_2.csv.edited"
    assert f"kept as {kept}; making it again" in run.output
    assert (tiny_copy / kept).read_text() == "time,angle\n1,2\n"
    assert target.read_bytes() == whole
    assert batch.read_bytes() == (tiny / batch.relative_to(tiny_copy)).read_bytes()


def started(
    folder: Path, *targets: str, environment: Mapping[str, str] = os.environ
) -> "subprocess.Popen[bytes]":
    """Start the workflow as `snakemake` does, and do not wait for it."""
    (folder / "overlay.yaml").write_text(TINY)
    command = [sys.executable, "-m", "snakemake", "-j2", *targets]
    command += ["--snakefile", str(ROOT / "Snakefile")]
    command += ["--directory", str(folder), "--configfile", str(folder / "overlay.yaml")]
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.STDOUT,
    )


ERRORS = "results/tables/errors_liquid_drop_2.csv"


def test_a_killed_run_continues_with_the_same_command(tiny: Path, tmp_path: Path) -> None:
    """Kill -9 of Snakemake in mid-run: the second call needs no other flag."""
    process = started(tmp_path, ERRORS, environment=loaded.for_jobs(os.environ))
    give_up = time.monotonic() + 120
    while not list((tmp_path / "results").glob("identifications/*/*/*.csv")):
        assert time.monotonic() < give_up
        assert process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert list((tmp_path / ".snakemake" / "locks").iterdir())
    # Snakemake alone cannot know that nobody else holds the lock.
    alone = snakemake(tmp_path, ERRORS, config=TINY)
    assert alone.status == 1
    assert "--unlock" in alone.output
    run = biogrip_run(tmp_path, ERRORS, "--quiet", "host", config=TINY)
    assert run.status == 0, run.output
    # Of four, one was there, but may not have been written down.
    assert 0 < run.jobs("identification") <= 4
    assert (run.jobs("target"), run.jobs("identifications")) == (0, 1)
    ours, theirs = results_of(tmp_path), results_of(tiny)
    assert ERRORS.removeprefix("results/") in ours
    assert [name for name in ours if ours[name] != theirs[name]] == []


@pytest.mark.nightly
def test_a_killed_job_is_done_again_with_the_same_command(tiny: Path, tiny_copy: Path) -> None:
    """Kill -9 of an identification in mid-run."""
    for stage in ("identifications", "histories", "timings"):
        shutil.rmtree(tiny_copy / "results" / stage / "liquid_drop_2")
    # What is asked for, and what it is made from; Snakemake minds no gap before that.
    for file in (ERRORS, "results/identifications/liquid_drop_2.csv"):
        (tiny_copy / file).unlink()
    process = started(tiny_copy, ERRORS)
    give_up = time.monotonic() + 60
    killed = None
    while killed is None:
        assert time.monotonic() < give_up
        assert process.poll() is None
        killed = next(filter(is_identification, psutil.Process(process.pid).children(True)), None)
    killed.kill()
    assert process.wait(60) != 0
    run = snakemake(tiny_copy, ERRORS, config=TINY)
    assert run.status == 0, run.output
    assert run.jobs("identification") > 0
    assert results_of(tiny_copy) == results_of(tiny)


def is_identification(process: psutil.Process) -> bool:
    try:
        command = process.cmdline()
    except psutil.Error:
        return False
    return command[2:4] == ["make", "identification"]


@pytest.mark.nightly
def test_a_full_disk_is_named_and_the_run_continues(tiny: Path, tmp_path: Path) -> None:
    """Results on a file system of their own, with room for a part of them, then for nothing."""
    study = tmp_path / "study"
    shutil.copytree(tiny, study, ignore=shutil.ignore_patterns("results"))
    disk = study / "results"
    disk.mkdir()
    tmpfs = ["mount", "-t", "tmpfs", "-o", "size=40m", "tmpfs", str(disk)]
    if subprocess.run(tmpfs, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small file system takes root")
    try:
        shutil.copytree(tiny / "results", disk, dirs_exist_ok=True)
        page = disk / "report.html"
        half = page.stat().st_size // 2
        page.unlink()
        filler = disk / "filler"
        filler.write_bytes(bytes(shutil.disk_usage(disk).free - half))
        filling = biogrip_run(study, config=TINY)
        with filler.open("ab") as stream:
            stream.write(bytes(shutil.disk_usage(disk).free))
        full = biogrip_run(study, config=TINY)
        filler.unlink()
        run = biogrip_run(study, config=TINY)
        results = results_of(study)
    finally:
        subprocess.run(["umount", str(disk)], check=True)
    # The jobs' messages go to logs, which found no room either.
    assert filling.status != 0
    assert full.status != 0
    assert "results: results cannot be written here: No space left on device" in full.output
    assert run.status == 0, run.output
    assert results == results_of(tiny)


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
    now = finished / "results" / "tables"
    done = biogrip(tmp_path, "compare", published, now)
    assert done.returncode != 0
    assert "gripper.md: regenerated, but not published" in done.stderr
    row = next(line for line in done.stderr.splitlines() if "99.9" in line)
    for word in ("errors", "endothelial_cell k_p", "typical_identified", "99.9"):
        assert word in row
    same = biogrip(tmp_path, "compare", now, now)
    assert same.returncode == 0
    assert "the same bytes" in same.stdout
