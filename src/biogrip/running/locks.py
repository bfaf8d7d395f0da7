"""Detection of locks that a killed Snakemake left behind, so that a run can be continued.

Snakemake locks its folder, and a kill leaves the lock behind. Each run therefore notes its
process and its lock files once it holds the lock. Locks of another computer, of a living run or
of unknown origin are nobody's to remove.
"""

import json
import os
import time
from pathlib import Path

from biogrip.files import write_text
from biogrip.running.journal import lives

_RUN = "run.json"


def sign_locks(snakemake_folder: Path) -> None:
    """Note that the locks in a ``.snakemake`` folder belong to this process."""
    run = {
        "host": os.uname().nodename,
        "pid": os.getpid(),
        "begun_ns": time.time_ns(),
        "locks": _locks(snakemake_folder),
    }
    write_text(snakemake_folder / _RUN, json.dumps(run))


def is_locked(snakemake_folder: Path) -> bool:
    """Return True if there are locks in a ``.snakemake`` folder."""
    return bool(_locks(snakemake_folder))


def is_locked_by_dead(snakemake_folder: Path) -> bool:
    """Return True if all locks in a ``.snakemake`` folder belong to a run that has ended."""
    locks = _locks(snakemake_folder)
    try:
        run = json.loads((snakemake_folder / _RUN).read_text())
        dead = run["host"] == os.uname().nodename and not lives(run["pid"], run["begun_ns"])
        return dead and bool(locks) and locks.items() <= dict(run["locks"]).items()
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def _locks(snakemake_folder: Path) -> dict[str, int]:
    """Return modification times of lock files, which distinguish locks of the same name."""
    files = (snakemake_folder / "locks").glob("*")
    return {file.name: file.stat().st_mtime_ns for file in files}
