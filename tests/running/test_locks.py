import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biogrip.running.locks import is_locked, is_locked_by_dead, sign_locks

HERE = os.uname().nodename


def locked_by(folder: Path, **run: object) -> Path:
    lock = folder / "locks" / "0.input.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("results/targets/a.csv")
    signed = {lock.name: lock.stat().st_mtime_ns}
    (folder / "run.json").write_text(json.dumps({"locks": signed, **run}))
    return lock


def test_the_lock_of_a_dead_run_is_known(tmp_path: Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    begun_ns = time.time_ns()
    child.wait()
    lock = locked_by(tmp_path, host=HERE, pid=child.pid, begun_ns=begun_ns)
    assert is_locked_by_dead(tmp_path)
    # Whose it is to remove is Snakemake.
    assert lock.exists()
    lock.unlink()
    assert not is_locked(tmp_path)
    assert not is_locked_by_dead(tmp_path)


@pytest.mark.parametrize(
    "run",
    [
        {"host": HERE, "pid": os.getpid(), "begun_ns": time.time_ns()},
        {"host": "elsewhere", "pid": 1, "begun_ns": 0},
        {},
        # Another run has locked the folder, but has not signed yet.
        {"host": HERE, "pid": 2**22 + 1, "begun_ns": 0, "locks": {}},
    ],
    ids=["living", "another computer's", "of unknown origin", "made after the dead run"],
)
def test_another_lock_is_not_taken_for_it(tmp_path: Path, run: dict[str, object]) -> None:
    locked_by(tmp_path, **run)
    assert is_locked(tmp_path)
    assert not is_locked_by_dead(tmp_path)


def test_a_reused_process_number_is_not_taken_for_the_run(tmp_path: Path) -> None:
    begun_ns = time.time_ns() - 10**14
    locked_by(tmp_path, host=HERE, pid=os.getpid(), begun_ns=begun_ns)
    assert is_locked_by_dead(tmp_path)


def test_a_run_signs_its_own_locks(tmp_path: Path) -> None:
    locked_by(tmp_path)
    sign_locks(tmp_path)
    assert not is_locked_by_dead(tmp_path)
    run = json.loads((tmp_path / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps({**run, "pid": 2**22 + 1}))
    assert is_locked_by_dead(tmp_path)
