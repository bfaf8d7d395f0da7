"""Stage 2: noisy traces of a target, one per seed."""

from collections.abc import Iterable
from pathlib import Path

from biogrip.experiment.noise import add_noise
from biogrip.experiment.random_streams import stream
from biogrip.records.traces import (
    Measurements,
    read_target,
    write_measurements,
)
from biogrip.study.study import Case


def measure(case: Case, seeds: Iterable[int], target: Path, measurements: Path) -> None:
    """Add noise of each seed in a batch to a target, CSV, and write the traces, Parquet."""
    time_s, _, rotation = read_target(target)
    traces = {
        seed: add_noise(
            rotation,
            case.noise,
            stream(case.study.study_seed, case.name, seed, "noise"),
            time_s,
        )
        for seed in seeds
    }
    write_measurements(measurements, Measurements(time_s, rotation, traces))
