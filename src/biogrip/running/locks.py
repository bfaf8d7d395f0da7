"""Removal of locks that a killed Snakemake left behind, so that a run can be continued.

Snakemake locks its folder, and a kill leaves the lock behind. Each run therefore notes its
process and its lock files once it holds the lock. Locks of a run that has provably ended are
removed; those of another computer, of a living run or of unknown origin are kept.
"""

import json
import socket
from pathlib import Path
from typing import Any

import psutil

from biogrip.files import write_text


def sign_locks(snakemake_folder: Path) -> None:
    """Note that the locks in a ``.snakemake`` folder belong to this process."""
    process = psutil.Process()
    run = {
        "host": socket.gethostname(),
        "pid": process.pid,
        "started": process.create_time(),
        "locks": _locks(snakemake_folder),
    }
    write_text(snakemake_folder / "run.json", json.dumps(run))


def is_locked(snakemake_folder: Path) -> bool:
    """Return whether there are locks in a ``.snakemake`` folder."""
    return any((snakemake_folder / "locks").glob("*"))


def release_dead_locks(snakemake_folder: Path) -> None:
    """Remove locks in a ``.snakemake`` folder that belong to a run that has ended."""
    if not (snakemake_folder / "run.json").is_file():
        return
    try:
        run = json.loads((snakemake_folder / "run.json").read_text())
        dead = _is_dead(run)
        signed = dict(run["locks"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return
    if dead:
        for name, changed in _locks(snakemake_folder).items():
            if signed.get(name) == changed:
                (snakemake_folder / "locks" / name).unlink(missing_ok=True)


def _locks(snakemake_folder: Path) -> dict[str, int]:
    """Return modification times of lock files, which distinguish locks of the same name."""
    files = (snakemake_folder / "locks").glob("*")
    return {file.name: file.stat().st_mtime_ns for file in files}


def _is_dead(run: dict[str, Any]) -> bool:
    if run["host"] != socket.gethostname():
        return False
    try:
        return abs(psutil.Process(run["pid"]).create_time() - run["started"]) > 1
    except psutil.NoSuchProcess:
        return True
