"""A study of many seeds, with what it costs: `python -m benchmarks.scale`, see docs/scale.md."""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import psutil

ROOT = Path(__file__).parents[1]
CONFIG = """
seeds: {seeds}
methods: [genetic]
identifiability: {{coverage_seeds: 0}}
model_selection: {{models: []}}
genetic_algorithm: {{population: {population}, survivors: {survivors}}}
"""
# Often enough to see every job, not so often that looking takes their time.
SAMPLED_EVERY_S = 0.25
CORES = 2


def main() -> None:
    """Run the default cases with many seeds of the genetic algorithm, and print the cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10_000, help="a case [%(default)s]")
    parser.add_argument("--population", type=int, default=500, help="[%(default)s]")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = folder / "scale.yaml"
        survivors = options.population // 2
        config.write_text(
            CONFIG.format(seeds=options.seeds, population=options.population, survivors=survivors)
        )
        command = [sys.executable, "-m", "snakemake", f"-j{CORES}", "--quiet", "all"]
        command += ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(folder)]
        command += ["--configfile", str(config)]
        start = time.monotonic()
        running = subprocess.Popen(command, cwd=ROOT)
        seen = _watched(running)
        wall_s = time.monotonic() - start
        if running.returncode:
            sys.exit(running.returncode)
        _report(folder / "results", wall_s, seen)


@dataclass
class Seen:
    """What was seen of a process, or of all of a kind.

    Parameters
    ----------
    processes
        How many.
    cpu_s
        Processor time when they were last looked at.
    peak_bytes
        Largest resident memory of one.
    """

    processes: int = 0
    cpu_s: float = 0.0
    peak_bytes: int = 0


def _watched(running: subprocess.Popen[bytes]) -> dict[str, Seen]:
    """Follow the processes of a run; by kind, see `_kind`."""
    seen: dict[tuple[str, int], Seen] = defaultdict(Seen)
    parent = psutil.Process(running.pid)
    while running.poll() is None:
        for process in [parent, *parent.children(recursive=True)]:
            try:
                one = seen[_kind(process.cmdline()), process.pid]
                one.peak_bytes = max(one.peak_bytes, process.memory_info().rss)
                one.cpu_s = sum(process.cpu_times()[:2])
            except psutil.Error:
                continue
        time.sleep(SAMPLED_EVERY_S)
    kinds: dict[str, Seen] = defaultdict(Seen)
    for (kind, _), one in seen.items():
        kinds[kind].processes += 1
        kinds[kind].cpu_s += one.cpu_s
        kinds[kind].peak_bytes = max(kinds[kind].peak_bytes, one.peak_bytes)
    return kinds


def _kind(command: list[str]) -> str:
    """The stage of a biogrip process, with the name of its table or figure."""
    words = [Path(word).name for word in command[1:4]]
    if words[:1] == ["biogrip"]:
        return " ".join(words[1:3] if words[1] in ("table", "figure") else words[1:2])
    return "snakemake" if "snakemake" in command else "others"


def _report(results: Path, wall_s: float, seen: dict[str, Seen]) -> None:
    files = sorted((results / "timings").glob("*.csv"))
    identifying_s = sum(float(pd.read_csv(file)["cpu_s"].sum()) for file in files)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"wall time {wall_s:.0f} s, processor time identifying {identifying_s:.0f} s")
    for what, spent_s in (
        (f"{CORES} cores' wall time", CORES * wall_s),
        ("processor time, which other programs disturb less", used.ru_utime + used.ru_stime),
    ):
        print(f"all else: {100 * (1 - identifying_s / spent_s):.1f} % of {spent_s:.0f} s of {what}")
    print("processor time, until last looked at, and largest memory:")
    for kind, of_kind in sorted(seen.items(), key=lambda item: -item[1].cpu_s):
        print(
            f"{of_kind.cpu_s:7.1f} s  {of_kind.peak_bytes / 1e6:5.0f} MB  "
            f"{of_kind.processes:4d} x {kind}"
        )
    for folder in sorted(path for path in results.iterdir() if path.is_dir()):
        sizes = [file.stat().st_size for file in folder.rglob("*") if file.is_file()]
        if sizes:
            print(f"{sum(sizes) / 1e6:7.1f} MB  {folder.name}/, largest {max(sizes) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
