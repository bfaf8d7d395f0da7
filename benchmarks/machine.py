"""What the benchmarks ran on."""

import platform
import re
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import psutil

PEERS = ("deap", "lmfit", "pygad", "pymoo", "pypesto")


def machine(peers: Sequence[str] = PEERS) -> dict[str, str]:
    """Describe processor, memory and the libraries that decide the speed."""
    build: dict[str, Any] = np.show_config(mode="dicts")  # type: ignore[assignment]
    blas = build["Build Dependencies"]["blas"]
    return {
        "processor": _processor(),
        "cores": str(psutil.cpu_count(logical=False) or psutil.cpu_count()),
        "memory": f"{psutil.virtual_memory().total / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "BLAS": f"{blas['name']} {blas['version']}, one thread",
        **{name: version(name) for name in ("scipy", *peers)},
    }


def _processor() -> str:
    described = Path("/proc/cpuinfo")
    if described.exists():
        found = re.search(r"^model name\s*:\s*(.*)$", described.read_text(), re.MULTILINE)
        if found:
            return found[1]
    return platform.processor()
