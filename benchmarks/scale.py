"""What a study of many seeds takes, process by process."""

import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import psutil
import yaml

from benchmarks.section import Row, Section, number
from benchmarks.setup import CONFIG

ROOT = Path(__file__).parents[1]
SEEDS, CASES, CORES = 10_000, 100, 2

_ALL, _PLANNING = "all", f"planning {CASES} such cases"
# Often enough to see every job, not so often that looking takes their time.
_LOOKED_EVERY_S = 0.25
# What grows with the seeds and is not asked for.
_WITHOUT: dict[str, Any] = {
    "methods": ["genetic"],
    "identifiability": {"coverage_seeds": 0},
    "model_selection": {"models": []},
}

_TEXT = f"""\
The three default cases with {SEEDS:,} seeds each of `genetic` and nothing else of what grows with
the seeds (no other method, no coverage, no model selection), by Snakemake with `-j{CORES}`:
processor time and largest resident memory of its processes, by what they make first, looked at four
times a second; and of a dry run with {CASES} such cases."""


@dataclass
class Seen:
    """What was seen of a process, or of all of a kind.

    Parameters
    ----------
    processes
        How many.
    processor_s
        Processor time when they were last looked at.
    largest_MB
        Largest resident memory of one.
    """

    processes: int = 0
    processor_s: float = 0.0
    largest_MB: float = 0.0


def scale_section() -> Section:
    """Run the study of many seeds, and plan one of many cases."""
    with tempfile.TemporaryDirectory() as name:
        wall_s, seen = run_study(Path(name), _WITHOUT | {"seeds": SEEDS})
        sizes = _sizes(Path(name) / "results")
    with tempfile.TemporaryDirectory() as name:
        cases = yaml.safe_load(CONFIG.read_text())["cases"]
        some = list(cases.values())
        many = {f"case_{index}": some[index % len(some)] for index in range(CASES)}
        overlay = _WITHOUT | {"seeds": SEEDS, "cases": many, "only": list(many)}
        planning_s, planning = run_study(Path(name), overlay, "--dry-run")
    rows = [
        *({"process": kind, **vars(of_kind)} for kind, of_kind in seen.items()),
        {"process": _ALL, **vars(_together(seen.values())), "wall_s": wall_s, **sizes},
        {"process": _PLANNING, **vars(_together(planning.values())), "wall_s": planning_s},
    ]
    columns: dict[str, Callable[[Row], str]] = {
        "process": lambda row: row["process"].replace("_", " "),
        "number": lambda row: str(row["processes"]),
        "processor time (s)": lambda row: number(row["processor_s"]),
        "largest (MB)": lambda row: f"{row['largest_MB']:.0f}",
        "wall time (s)": lambda row: number(row["wall_s"]) if "wall_s" in row else "",
    }
    return Section("scale", "Many seeds, many cases", _TEXT, columns, rows)


def watch_writes(command: Sequence[str], folder: Path) -> dict[str, Seen]:
    """Run a command in a folder, and follow its processes; by kind, the most costly first.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    seen: dict[tuple[str, int], Seen] = defaultdict(lambda: Seen(processes=1))
    with (folder / "log.txt").open("w") as log:
        running = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log)
    parent = psutil.Process(running.pid)
    while running.poll() is None:
        try:
            for process in [parent, *parent.children(recursive=True)]:
                _look(process, seen)
        except psutil.NoSuchProcess:
            continue
        time.sleep(_LOOKED_EVERY_S)
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, command)
    by_kind: dict[str, list[Seen]] = defaultdict(list)
    for (kind, _), one in seen.items():
        by_kind[kind].append(one)
    kinds = {kind: _together(some) for kind, some in by_kind.items()}
    return dict(sorted(kinds.items(), key=lambda item: -item[1].processor_s))


def run_study(
    folder: Path, overlay: dict[str, Any], *options: str
) -> tuple[float, dict[str, Seen]]:
    """Run a study in a folder by Snakemake; its wall time, and what was seen of its processes."""
    config = folder / "scale.yaml"
    config.write_text(yaml.safe_dump(overlay))
    command = [sys.executable, "-m", "snakemake", f"-j{CORES}", "--quiet", "all", *options]
    command += ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(folder)]
    command += ["--configfile", str(config)]
    start = time.monotonic()
    seen = watch_writes(command, folder)
    return time.monotonic() - start, seen


def _look(process: psutil.Process, seen: dict[tuple[str, int], Seen]) -> None:
    try:
        kind = _kind(process.cmdline())
        if kind is None:
            return
        one = seen[kind, process.pid]
        one.largest_MB = max(one.largest_MB, process.memory_info().rss / 1e6)
        one.processor_s = sum(process.cpu_times()[:2])
    except psutil.Error:
        return


def _kind(command: Sequence[str]) -> str | None:
    """What a process makes, if it is one of the study's and no shell between them."""
    if "snakemake" in command:
        return "Snakemake"
    return command[command.index("make") + 1] if "make" in command[:-1] else None


def _together(seen: Collection[Seen]) -> Seen:
    return Seen(
        sum(one.processes for one in seen),
        sum(one.processor_s for one in seen),
        max(one.largest_MB for one in seen),
    )


def _sizes(results: Path) -> dict[str, float]:
    """Processor time of the identifications alone, and sizes of what is kept of all seeds, MB."""
    timings = (pd.read_csv(file) for file in (results / "timings").glob("*.csv"))
    found = {"identifying_s": sum(float(of_case["cpu_s"].sum()) for of_case in timings)}
    for kind in ("measurements", "histories", "identifications"):
        files = (path for path in (results / kind).rglob("*") if path.is_file())
        found[f"{kind}_MB"] = sum(path.stat().st_size for path in files) / 1e6
    return found
