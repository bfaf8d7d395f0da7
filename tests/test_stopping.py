import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biogrip.files import scratch_path, write_text
from tests.helpers.identified import FEW, write_drop

BEGIN = """
import atexit, os, sys, time
from pathlib import Path
from biogrip.terminal import end_when_stopped
def stop():
    print("said before")
    os.kill(os.getpid(), {number})
    time.sleep(60)
end_when_stopped()
"""
# Where an exception would be made another error of, or would be printed and forgotten.
PLACES = {
    "a library that is being loaded": """
try:
    stop()
except BaseException as error:
    raise ImportError("not initialized") from error
""",
    "a finalizer": """
class Finalized:
    def __del__(self):
        stop()
Finalized()
""",
    "a file being written": """
from biogrip.files import atomic_write
with atomic_write(Path("table.csv")) as scratch:
    scratch.write_text("a,b")
    stop()
""",
    "the end": """
atexit.register(stop)
""",
}


def ended(code: str, folder: Path) -> tuple[int, str, str]:
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    return run.returncode, run.stdout, run.stderr


@pytest.mark.parametrize("place", PLACES)
def test_it_says_so_in_a_line_and_leaves_nothing(tmp_path: Path, place: str) -> None:
    number = (signal.SIGINT, signal.SIGTERM)[list(PLACES).index(place) % 2]
    # As a shell's background has it, Python would leave SIGINT ignored.
    code = f"import signal; signal.signal({signal.SIGINT}, signal.default_int_handler)"
    code += BEGIN.format(number=int(number)) + PLACES[place]
    how = {signal.SIGINT: "stopped", signal.SIGTERM: "ended by SIGTERM"}[number]
    told = f"biogrip: {how}; no file was left half-written.\n"
    assert ended(code, tmp_path) == (128 + number, "said before\n", told)
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And then its name: both are really done, and only the order is noted."""
    done: list[tuple[str, str]] = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(opened: int) -> None:
        done.append(("on the disk", os.readlink(f"/proc/self/fd/{opened}")))
        fsync(opened)

    def noted_replace(scratch: Path, path: Path) -> None:
        done.append(("named", str(path)))
        replace(scratch, path)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    file = tmp_path / "found.csv"
    write_text(file, "a")
    on_disk = ("on the disk", str(scratch_path(file))), ("on the disk", str(tmp_path))
    assert done == [on_disk[0], ("named", str(file)), on_disk[1]]


def test_a_link_in_the_place_of_a_scratch_file_is_not_followed(tmp_path: Path) -> None:
    """One that somebody else has put there, who can foresee its name; it may lead nowhere."""
    for victim in ("victim.txt", "nothing.txt"):
        (tmp_path / "victim.txt").write_text("precious")
        scratch_path(tmp_path / "found.csv").symlink_to(victim)
        write_text(tmp_path / "found.csv", "a,b\n")
        assert (tmp_path / "victim.txt").read_text() == "precious"
        assert (tmp_path / "found.csv").read_text() == "a,b\n"
        assert not (tmp_path / "found.csv").is_symlink()
        assert {it.name for it in tmp_path.iterdir()} == {"found.csv", "victim.txt"}


def test_what_a_killed_process_has_left_goes_with_the_next_write(tmp_path: Path) -> None:
    """But not what one that still runs is writing, nor what only looks like it."""
    (over := subprocess.Popen(["true"])).wait()
    file = tmp_path / "found[1].csv"
    kept = [
        f".{file.name}.{os.getppid()}.part",
        f".{file.name}.old.part",
        f".1.csv.{over.pid}.part",
    ]
    for name in (f".{file.name}.{over.pid}.part", *kept):
        (tmp_path / name).write_text("a,")
    write_text(file, "a,b\n")
    assert {it.name for it in tmp_path.iterdir()} == {file.name, *kept}


def test_what_is_ignored_stays_so(tmp_path: Path) -> None:
    code = f"import signal; signal.signal({signal.SIGINT}, signal.SIG_IGN)"
    code += BEGIN + f"os.kill(os.getpid(), {signal.SIGINT}); print('goes on')"
    assert ended(code, tmp_path) == (0, "goes on\n", "")


def test_it_can_be_stopped_before_it_loads_anything_large(tmp_path: Path) -> None:
    """What is loaded before the signals are taken is what a stop would show a stack of."""
    code = "import sys; b = {*sys.modules}; import biogrip.__main__; print(*{*sys.modules} - b)"
    loaded = set(ended(code, tmp_path)[1].split())
    ours = {name for name in loaded if name.startswith("biogrip")}
    assert ours == {"biogrip", "biogrip.__main__", "biogrip.terminal"}
    assert not {"argparse", "json", "typing", "hashlib", "pathlib"} & loaded


@pytest.mark.nightly
@pytest.mark.parametrize("page", [False, True])
def test_a_batch_that_is_killed_gives_the_same_bytes_after_the_next_call(
    tmp_path: Path, page: bool
) -> None:
    """At 30 moments of the whole run, from loading to the table; nothing half-written is left."""
    names = [f"cell_{number}.csv" for number in range(4)]
    (tmp_path / "few.yaml").write_text(FEW)
    for seed, name in enumerate(names):
        write_drop(tmp_path / name, seed)
    (tmp_path / "cells.tsv").write_text("\n".join(["file", *names]))
    command = [sys.executable, "-m", "biogrip", "identify", "cells.tsv", "--config", "few.yaml"]
    command += ["--model", "liquid_drop", "--csv", "found.csv", *["--report", "page.html"] * page]
    outputs = ["found.csv", *["page.html"] * page]

    def called(after_s: float | None = None) -> float:
        begun_s = time.monotonic()
        with open(os.devnull, "w") as quiet:
            run = subprocess.Popen(
                command, cwd=tmp_path, start_new_session=True, stdout=quiet, stderr=quiet
            )
        try:
            assert run.wait(after_s) == 0
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
            run.wait()
        return time.monotonic() - begun_s

    lasts_s = called()
    whole = {output: (tmp_path / output).read_bytes() for output in outputs}
    given = {"cells.tsv", "few.yaml", *names}
    rng = random.Random(0)
    for _ in range(30):
        for left in tmp_path.iterdir():
            if left.name not in given:
                left.unlink()
        called(rng.uniform(0.05, 1.0) * lasts_s)
        called()
        assert {output: (tmp_path / output).read_bytes() for output in outputs} == whole
        assert not [left for left in tmp_path.iterdir() if left.name.startswith(".")]
