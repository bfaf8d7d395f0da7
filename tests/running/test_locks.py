import json
import socket
import subprocess
import sys
from pathlib import Path

import psutil

from biogrip.running.locks import release_dead_locks, sign_locks


def locked_by(folder: Path, **run: object) -> Path:
    lock = folder / "locks" / "0.input.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("results/targets/a.csv")
    signed = {lock.name: lock.stat().st_mtime_ns}
    (folder / "run.json").write_text(json.dumps({"locks": signed, **run}))
    return lock


def test_the_lock_of_a_dead_run_is_taken_away(tmp_path: Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    started = psutil.Process(child.pid).create_time()
    child.wait()
    lock = locked_by(tmp_path, host=socket.gethostname(), pid=child.pid, started=started)
    release_dead_locks(tmp_path)
    assert not lock.exists()


def test_the_lock_of_a_living_run_stays(tmp_path: Path) -> None:
    me = psutil.Process()
    lock = locked_by(tmp_path, host=socket.gethostname(), pid=me.pid, started=me.create_time())
    release_dead_locks(tmp_path)
    assert lock.exists()


def test_a_reused_process_number_is_not_taken_for_the_run(tmp_path: Path) -> None:
    me = psutil.Process()
    lock = locked_by(tmp_path, host=socket.gethostname(), pid=me.pid, started=me.create_time() - 99)
    release_dead_locks(tmp_path)
    assert not lock.exists()


def test_the_lock_of_another_machine_stays(tmp_path: Path) -> None:
    lock = locked_by(tmp_path, host="elsewhere", pid=1, started=0.0)
    release_dead_locks(tmp_path)
    assert lock.exists()


def test_a_lock_of_unknown_origin_stays(tmp_path: Path) -> None:
    lock = locked_by(tmp_path)
    release_dead_locks(tmp_path)
    assert lock.exists()


def test_a_lock_made_after_the_dead_run_stays(tmp_path: Path) -> None:
    """Another run has locked the folder, but has not signed yet."""
    lock = locked_by(tmp_path, host=socket.gethostname(), pid=2**22 + 1, started=0.0, locks={})
    release_dead_locks(tmp_path)
    assert lock.exists()


def test_a_run_signs_its_own_locks(tmp_path: Path) -> None:
    lock = locked_by(tmp_path)
    sign_locks(tmp_path)
    release_dead_locks(tmp_path)
    assert lock.exists()
    run = json.loads((tmp_path / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps({**run, "started": run["started"] - 99}))
    release_dead_locks(tmp_path)
    assert not lock.exists()
