"""`biogrip run`: configs are checked before Snakemake sees them, and the end is a line."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from tests.helpers.places import EXAMPLE
from tests.helpers.runs import TINY, called, started

pytestmark = pytest.mark.nightly

BAD = {
    "missing": (None, r"my.yaml: cannot be read: No such file"),
    "tab": ("seeds: 4\n\tx: 1\n", r"my.yaml, line 2: not valid YAML: found a tab character"),
    "bracket": ("methods: [genetic\nseeds: 3\n", r"my.yaml, line \d: not valid YAML"),
    "list": ("- seeds\n", r"my.yaml, line 1: found no keys"),
    "not UTF-8": (
        b"seeds: 3 # \xff\n",
        r"my.yaml, line 1: found the byte 0xff, allowed is text in UTF-8",
    ),
    "unknown key": ("seedz: 3\n", r"my.yaml, line 1: seedz: unknown key. Did you mean 'seeds'"),
    "program": (
        '__use_yte__: true\nseeds: ?__import__("os").system("touch {folder}/ran")\n',
        r"my.yaml, line 1: __use_yte__ makes Snakemake run code",
    ),
}


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """What is started can be stopped, be the tests themselves in the background of a script."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("kind", BAD)
def test_a_config_that_cannot_be_used_is_named_before_anything_starts(
    tmp_path: Path, kind: str
) -> None:
    content, message = BAD[kind]
    if isinstance(content, str):
        (tmp_path / "my.yaml").write_text(content.replace("{folder}", str(tmp_path)))
    elif content is not None:
        (tmp_path / "my.yaml").write_bytes(content)
    run = called(tmp_path, "run", "my.yaml", "-n")
    assert run.status == 1
    assert re.search(message, run.output)
    assert len(run.output.splitlines()) <= 2
    assert {path.name for path in tmp_path.iterdir()} <= {"my.yaml"}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["-n", "--configfile", "missing.yaml"], "missing.yaml: cannot be read: No such file"),
        (["--configfile", "my.yaml", "-n"], "my.yaml, line 2: seedz: unknown key"),
        (["my.yaml", "-n", "--configfile"], "--configfile: needs a file"),
        (["-n", "--config", "seedz=3"], "seedz: unknown key"),
    ],
)
def test_config_files_may_be_given_as_to_snakemake(
    tmp_path: Path, given: list[str], message: str
) -> None:
    (tmp_path / "my.yaml").write_text("seeds: 2\nseedz: 3\n")
    run = called(tmp_path, "run", *given)
    assert run.status == 1
    assert message in run.output
    assert "Traceback" not in run.output
    assert "Building DAG" not in run.output


def test_a_run_ends_by_naming_what_to_open(tiny: Path, tiny_copy: Path) -> None:
    errors = "results/tables/errors.csv"
    (tiny_copy / errors).unlink()
    run = called(tiny_copy, "run", "overlay.yaml", "-j2", errors)
    assert run.status == 0, run.output
    # What was asked for, not pages that an earlier run has made.
    assert run.output.splitlines()[-1] == f"biogrip: done. Open {errors}."
    run = called(tiny_copy, "run", "overlay.yaml", "-j2")
    assert run.status == 0, run.output
    assert run.output.splitlines()[-1] == (
        "biogrip: done. Open results/report.html, results/summaries/liquid_drop_2.html."
    )
    assert (tiny_copy / errors).read_bytes() == (tiny / errors).read_bytes()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_stopped_run_ends_with_what_goes_on(tmp_path: Path, number: signal.Signals) -> None:
    (tmp_path / "my.yaml").write_text(TINY)
    with started(tmp_path, "run", "my.yaml", "-j2") as run:
        give_up = time.monotonic() + 120
        while not list((tmp_path / "results").glob("measurements/*/*.parquet")):
            assert time.monotonic() < give_up
            time.sleep(0.05)
        os.kill(run.pid, number)
        output, _ = run.communicate(timeout=60)
    assert run.returncode == 128 + number
    assert output.splitlines()[-1] == (
        f"biogrip: stopped by {number.name}. Nothing that is done is lost; "
        "to go on: biogrip run my.yaml -j2"
    )
    assert "Traceback" not in output
    assert not [p for p in psutil.process_iter(["cwd"]) if p.info["cwd"] == str(tmp_path)]
    (target,) = (tmp_path / "results").glob("targets/*.csv")
    done = target.stat().st_mtime_ns
    again = called(tmp_path, "run", "my.yaml", "-j2", target.relative_to(tmp_path))
    assert again.status == 0, again.output
    assert target.stat().st_mtime_ns == done


@pytest.mark.parametrize("loaded", ["_yaml", "snakemake_process", "matplotlib"])
def test_a_run_is_stopped_in_a_line_while_it_starts(tmp_path: Path, loaded: str) -> None:
    """While configs are checked, while Snakemake is loaded, and while it plans."""
    (tmp_path / "my.yaml").write_text(TINY)
    with started(tmp_path, "run", "my.yaml", "-j2") as run:
        give_up = time.monotonic() + 60
        while not any(loaded in line for line in loads(run.pid)):
            assert time.monotonic() < give_up
            assert run.poll() is None
            time.sleep(0.01)
        os.kill(run.pid, signal.SIGINT)
        output, _ = run.communicate(timeout=60)
    assert run.returncode == 128 + signal.SIGINT
    assert "Traceback" not in output
    assert output.splitlines()[-1].endswith("to go on: biogrip run my.yaml -j2")


def loads(pid: int) -> list[str]:
    """What a run, and Snakemake in it, are and have mapped."""
    found = []
    for process in (psutil.Process(pid), *psutil.Process(pid).children()):
        with suppress(psutil.Error, OSError):
            found += [*process.cmdline(), *(m.path for m in process.memory_maps())]
    return found


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=lambda s: s.name)
def test_what_became_of_snakemake_is_said(tmp_path: Path, number: signal.Signals) -> None:
    """Somebody, or the system that is out of memory, ends it and not the command."""
    (tmp_path / "my.yaml").write_text(TINY)
    with started(tmp_path, "run", "my.yaml", "-j2") as run:
        give_up = time.monotonic() + 60
        while not any("matplotlib" in line for line in loads(run.pid)):
            assert time.monotonic() < give_up
            time.sleep(0.01)
        (snakemake,) = psutil.Process(run.pid).children()
        snakemake.send_signal(number)
        output, _ = run.communicate(timeout=60)
    assert run.returncode == 128 + number
    assert output.splitlines()[-1] == (
        f"biogrip: Snakemake was ended by {number.name}. Nothing that is done is lost; "
        "to go on: biogrip run my.yaml -j2"
    )


@pytest.mark.parametrize("options", [["-n"], ["-j1"], ["-n", "--quiet"]], ids=" ".join)
def test_what_is_to_be_made_may_stand_behind_two_dashes(
    tiny_copy: Path, options: list[str]
) -> None:
    (tiny_copy / "results" / "tables" / "errors.csv").unlink()
    target = "results/targets/liquid_drop_2.csv"
    run = called(tiny_copy, "run", "overlay.yaml", *options, "--", target)
    assert run.status == 0, run.output
    assert "No rule to produce" not in run.output
    assert run.jobs("tables") == 0


@pytest.mark.parametrize("kind", ["file", "link"])
def test_what_is_in_the_place_of_a_folder_is_named(tmp_path: Path, kind: str) -> None:
    """Of Snakemake's, before it is started, and of ours, before a job is."""
    (tmp_path / "my.yaml").write_text(TINY)
    (tmp_path / "elsewhere").mkdir()
    for name in (".snakemake", "results", "results/targets", "results/.manifest"):
        place = tmp_path / name
        place.parent.mkdir(exist_ok=True)
        if kind == "file":
            place.write_text("mine")
        else:
            place.symlink_to(tmp_path / "elsewhere")
        for more in (["-n"], ["-j1"]):
            run = called(tmp_path, "run", "my.yaml", *more)
            assert run.status == 1
            assert f"biogrip: {name}: " in run.output
            assert "Traceback" not in run.output
        assert not list((tmp_path / "elsewhere").iterdir())
        place.unlink()


def test_a_run_in_the_background_of_a_script_is_stopped_too(tmp_path: Path) -> None:
    """There SIGINT is ignored, which programs that are started go on doing."""
    (tmp_path / "my.yaml").write_text(TINY)
    command = [sys.executable, "-m", "biogrip", "run", "my.yaml", "-j2"]
    ignoring = "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    starting = f"{ignoring}os.execv(sys.executable, {command!r})"
    with subprocess.Popen(
        [sys.executable, "-c", starting], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as run:
        give_up = time.monotonic() + 120
        while not list((tmp_path / "results").glob("targets/*.csv")):
            assert time.monotonic() < give_up
            time.sleep(0.05)
        os.kill(run.pid, signal.SIGINT)
        time.sleep(0.5)
        assert run.poll() is None
        os.kill(run.pid, signal.SIGTERM)
        _, said = run.communicate(timeout=60)
    assert run.returncode == 128 + signal.SIGTERM
    assert said.splitlines()[-1].startswith("biogrip: stopped by SIGTERM")


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for name, found in (("file", "found a file"), ("file/x", "Not a directory"), ("x" * 300, "")):
        run = called(tmp_path, "run", "--directory", name, "-n")
        assert run.status == 1
        assert run.output.startswith("biogrip: --directory: ")
        assert f"{found or 'too long'}, allowed is a folder.\n" in run.output
        assert run.output.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_stopped_command_says_so_in_a_line(tmp_path: Path, number: signal.Signals) -> None:
    with started(tmp_path, "identify", EXAMPLE, "--output", "found.json") as run:
        # Its own handlers are in place before the libraries are loaded.
        give_up = time.monotonic() + 60
        while not any("numpy" in m.path for m in psutil.Process(run.pid).memory_maps()):
            assert time.monotonic() < give_up
            time.sleep(0.01)
        os.kill(run.pid, number)
        output, _ = run.communicate(timeout=60)
    assert run.returncode == 128 + number
    assert output.startswith("biogrip: ")
    assert output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
