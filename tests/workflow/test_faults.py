import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from tests.helpers.identified import write_drop
from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, ran, results_of, snakemake

pytestmark = pytest.mark.nightly

ERRORS = "results/tables/errors_liquid_drop_2.csv"


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_after_a_kill_the_same_command_ends_with_the_undisturbed_bytes(
    tiny: Path, tiny_copy: Path, how: signal.Signals
) -> None:
    """Of Snakemake when there is a result; after kill -9 it asks to be unlocked."""
    for stage in ("identifications", "histories"):
        shutil.rmtree(tiny_copy / "results" / stage / "liquid_drop_2")
    for file in (ERRORS, "results/identifications/liquid_drop_2.csv"):
        (tiny_copy / file).unlink()
    command: list[str | Path] = [sys.executable, "-m", "snakemake", "-j1", "-s", ROOT / "Snakefile"]
    process = subprocess.Popen(
        [*command, "--configfile", tiny_copy / "overlay.yaml", "--", ERRORS],
        cwd=tiny_copy,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        # Tests that run in the background ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    give_up = time.monotonic() + 120
    while not [*tiny_copy.glob("results/identifications/liquid_drop_2/*/*.csv")]:
        assert time.monotonic() < give_up
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(how)
    assert process.wait() != 0
    if how == signal.SIGKILL:
        again = snakemake(tiny_copy, "--", ERRORS, config=TINY, status=1)
        assert "--unlock" in again
        snakemake(tiny_copy, "--unlock", config=TINY)
    snakemake(tiny_copy, "--", ERRORS, "results/tables/methods.csv", config=TINY)
    ours, theirs = results_of(tiny_copy), results_of(tiny)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []


def _killed_after(folder: Path, seconds: float, *command: str | Path) -> None:
    """Kill a command with all its processes, unless it has ended."""
    process = subprocess.Popen(
        [sys.executable, *command],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _files(folder: Path) -> dict[str, bytes]:
    return {it.name: it.read_bytes() for it in folder.iterdir()}


def _whole(files: dict[str, bytes]) -> dict[str, bytes]:
    """Return files but for those that a kill has left unfinished."""
    return {name: it for name, it in files.items() if not name.endswith(".part")}


MOMENTS = 20


@pytest.mark.parametrize("more", [(), ("--report", "page.html")])
@pytest.mark.parametrize("samples", [False, True])
def test_a_batch_killed_at_any_moment_ends_with_the_undisturbed_bytes(
    tmp_path: Path, few: Path, more: tuple[str, ...], samples: bool
) -> None:
    """And no trace, or sample of several, that had its result loses it; nothing else is left."""
    files = [f"{number}.csv" for number in range(6)]
    asked = ["cells.tsv"] if samples else files
    command: list[str | Path] = ["-m", "biogrip", "identify", *asked, "--config", few]
    command += ["--model", "liquid_drop", "--no-compare", "--csv", "found.csv", *more]

    def folder_of(name: str) -> Path:
        (folder := tmp_path / name).mkdir()
        rows = ["file\tsample", *(f"{file}\tcell {int(file[0]) // 2}" for file in files)]
        (folder / "cells.tsv").write_text("\n".join(rows))
        for seed, file in enumerate(files):
            write_drop(folder / file, seed // 2 if samples else seed)
        return folder

    undisturbed, began = folder_of("undisturbed"), time.monotonic()
    ran(undisturbed, sys.executable, *command)
    lasts_s = time.monotonic() - began
    for moment in range(MOMENTS):
        folder = folder_of(str(moment))
        _killed_after(folder, lasts_s * moment / MOMENTS, *command)
        left = _whole(_files(folder))
        assert left.items() <= _files(undisturbed).items()
        done = {file: (folder / file).stat().st_mtime_ns for file in left if "json" in file}
        ran(folder, sys.executable, *command)
        # With a page, which has pictures, all traces are fitted again.
        assert more or done == {file: (folder / file).stat().st_mtime_ns for file in done}
        assert _files(folder) == _files(undisturbed)


def test_a_study_killed_at_many_moments_ends_with_the_undisturbed_bytes(
    tiny: Path, tmp_path: Path
) -> None:
    """Each time it goes on from what there is; all its processes are killed at once."""
    shutil.copy(tiny / "mine.csv", tmp_path)
    (tmp_path / "overlay.yaml").write_text(yaml.safe_dump(TINY))
    study: list[str | Path] = ["-m", "snakemake", "-j2", "-s", ROOT / "Snakefile"]
    study += ["--configfile", "overlay.yaml"]
    theirs = results_of(tiny)
    for moment in range(MOMENTS):
        _killed_after(tmp_path, 4 + moment, *study)
        # What has its name is whole.
        left = _whole(results_of(tmp_path))
        assert [name for name in left if left[name] != theirs[name]] == []
        ran(tmp_path, sys.executable, *study, "--unlock")
    ran(tmp_path, sys.executable, *study)
    ours = results_of(tmp_path)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []


def test_a_study_runs_in_a_folder_with_a_blank(tmp_path: Path) -> None:
    """And a quote: by a link to this environment, a table by a job of Snakemake."""
    folder = tmp_path / "my client's documents"
    (folder / "study").mkdir(parents=True)
    (folder / "venv").symlink_to(Path(sys.executable).parents[1])
    table = "results/tables/gripper.csv"
    command = (folder / "venv" / "bin" / "python", "-m", "snakemake", "-j1", "-s")
    ran(folder / "study", *command, ROOT / "Snakefile", "--", table)
    assert (folder / "study" / table).is_file()


def test_what_is_missing_or_locked_is_said_and_made_again(tiny: Path, tiny_copy: Path) -> None:
    (tiny_copy / ERRORS).unlink()
    lock = tiny_copy / ".snakemake" / "locks" / "0.output.lock"
    lock.parent.mkdir(parents=True, exist_ok=True)
    lock.write_text(f"{ERRORS}\n")
    refused = snakemake(tiny_copy, "--", ERRORS, config=TINY, status=1)
    assert "Directory cannot be locked" in refused
    shutil.rmtree(tiny_copy / ".snakemake")
    snakemake(tiny_copy, "--", ERRORS, config=TINY)
    assert (tiny_copy / ERRORS).read_bytes() == (tiny / ERRORS).read_bytes()


def test_a_full_disk_leaves_no_part_of_a_file(tmp_path: Path) -> None:
    """Of a process that may write a kilobyte a file: EFBIG, which is reported as ENOSPC is."""
    code = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024));"
        "from pathlib import Path; from biogrip.files import write_text;"
        "write_text(Path('table.csv'), 'a' * 5000)"
    )
    run = ran(tmp_path, sys.executable, "-c", code, status=1)
    assert "table.csv: cannot be written: File too large." in run
    assert list(tmp_path.iterdir()) == []
