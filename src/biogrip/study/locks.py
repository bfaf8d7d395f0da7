"""Lets a run that was killed be continued with the same command.

Snakemake locks its folder, and a killed Snakemake leaves the lock behind. Here
every run leaves its name beside the lock; a lock whose run is provably gone is
taken away. A lock of another machine, or of a run that lives, is left alone.
"""

import json
import socket
from pathlib import Path

import psutil


def take_over_dead_run(snakemake_folder: Path) -> None:
    """Remove the lock of a dead run, if there is one, and leave this run's name.

    Parameters
    ----------
    snakemake_folder
        The ``.snakemake`` folder of the working directory.
    """
    locks = list((snakemake_folder / "locks").glob("*"))
    name = snakemake_folder / "run.json"
    if locks and not _is_dead(name):
        return
    for lock in locks:
        lock.unlink(missing_ok=True)
    snakemake_folder.mkdir(exist_ok=True)
    name.write_text(json.dumps(_this_run()))


def _this_run() -> dict[str, str | int | float]:
    process = psutil.Process()
    return {
        "host": socket.gethostname(),
        "pid": process.pid,
        "started": process.create_time(),
    }


def _is_dead(name: Path) -> bool:
    try:
        run = json.loads(name.read_text())
        if run["host"] != socket.gethostname():
            return False
        return abs(psutil.Process(run["pid"]).create_time() - run["started"]) > 1
    except psutil.NoSuchProcess:
        return True
    except (OSError, ValueError, KeyError, TypeError):
        return False
