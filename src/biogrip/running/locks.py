"""Lets a run that was killed be continued with the same command.

Snakemake locks its folder, and a killed Snakemake leaves the lock behind. Here
every run writes down, once it holds its lock, who it is and which lock files are
its own. Those of a run that is provably gone are taken away; a lock of another
machine, of a run that lives, or that nobody signed is left alone.
"""

import json
import socket
from pathlib import Path
from typing import Any

import psutil

from biogrip.files import write_text


def sign_locks(snakemake_folder: Path) -> None:
    """Write down that the locks in a ``.snakemake`` folder are this run's."""
    process = psutil.Process()
    run = {
        "host": socket.gethostname(),
        "pid": process.pid,
        "started": process.create_time(),
        "locks": _locks(snakemake_folder),
    }
    write_text(snakemake_folder / "run.json", json.dumps(run))


def is_locked(snakemake_folder: Path) -> bool:
    """Whether a run holds locks in a ``.snakemake`` folder."""
    return any((snakemake_folder / "locks").glob("*"))


def release_dead_locks(snakemake_folder: Path) -> None:
    """Remove the locks that a dead run has signed in a ``.snakemake`` folder."""
    try:
        run = json.loads((snakemake_folder / "run.json").read_text())
        dead = _is_dead(run)
        signed = dict(run["locks"])
    except (OSError, ValueError, KeyError, TypeError):
        return
    if dead:
        for name, changed in _locks(snakemake_folder).items():
            if signed.get(name) == changed:
                (snakemake_folder / "locks" / name).unlink(missing_ok=True)


def _locks(snakemake_folder: Path) -> dict[str, int]:
    """When each lock file was made: a later run's lock has the same name, but not the same time."""
    files = (snakemake_folder / "locks").glob("*")
    return {file.name: file.stat().st_mtime_ns for file in files}


def _is_dead(run: dict[str, Any]) -> bool:
    if run["host"] != socket.gethostname():
        return False
    try:
        return abs(psutil.Process(run["pid"]).create_time() - run["started"]) > 1
    except psutil.NoSuchProcess:
        return True
