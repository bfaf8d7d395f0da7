"""A study of many seeds, with what it costs: `python -m benchmarks.scale`, see docs/scale.md."""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
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
SAMPLED_EVERY_S = 0.1
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
        peaks = _watched(running)
        wall_s = time.monotonic() - start
        if running.returncode:
            sys.exit(running.returncode)
        _report(folder / "results", wall_s, peaks)


def _watched(running: subprocess.Popen[bytes]) -> dict[str, int]:
    """Largest resident memory in bytes of each kind of process, by name."""
    peaks: dict[str, int] = defaultdict(int)
    parent = psutil.Process(running.pid)
    while running.poll() is None:
        for process in [parent, *parent.children(recursive=True)]:
            try:
                kind = _kind(process.cmdline())
                peaks[kind] = max(peaks[kind], process.memory_info().rss)
            except psutil.Error:
                continue
        time.sleep(SAMPLED_EVERY_S)
    return peaks


def _kind(command: list[str]) -> str:
    """The stage of a biogrip process, with the name of its table or figure."""
    words = [Path(word).name for word in command[1:4]]
    if words[:1] == ["biogrip"]:
        return " ".join(words[1:3] if words[1] in ("table", "figure") else words[1:2])
    return "snakemake" if "snakemake" in command else "others"


def _report(results: Path, wall_s: float, peaks: dict[str, int]) -> None:
    files = sorted((results / "timings").glob("*.csv"))
    identifying_s = sum(float(pd.read_csv(file)["cpu_s"].sum()) for file in files)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"wall time {wall_s:.0f} s, processor time identifying {identifying_s:.0f} s")
    for what, spent_s in (
        (f"{CORES} cores' wall time", CORES * wall_s),
        ("processor time, which other programs disturb less", used.ru_utime + used.ru_stime),
    ):
        print(f"all else: {100 * (1 - identifying_s / spent_s):.1f} % of {spent_s:.0f} s of {what}")
    for kind, peak in sorted(peaks.items(), key=lambda item: -item[1]):
        print(f"{peak / 1e6:7.0f} MB  {kind}")
    for folder in sorted(path for path in results.iterdir() if path.is_dir()):
        sizes = [file.stat().st_size for file in folder.rglob("*") if file.is_file()]
        if sizes:
            print(f"{sum(sizes) / 1e6:7.1f} MB  {folder.name}/, largest {max(sizes) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
