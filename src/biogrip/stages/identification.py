"""Stage 3: the sample's parameters from each noisy trace."""

import time
from pathlib import Path
from typing import Any

from biogrip.identify.methods import METHODS, identifier_of_many
from biogrip.identify.records import (
    Record,
    write_histories,
    write_identifications,
    write_timings,
)
from biogrip.measurement import rms
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.study.case_problem import case_problem
from biogrip.traces import read_measurements


def run(
    settings: dict[str, Any],
    seeds: list[int],
    measurements: Path,
    output: Path,
    history: Path,
    timing: Path,
    calibrated: Path | None = None,
) -> None:
    """Identify a batch of seeds with one method.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``method``, what `case_problem` needs, and the
        method's blocks.
    seeds
        The batch.
    measurements
        Noisy traces, Parquet.
    output, history
        Identified parameters, CSV, and the way to them, Parquet.
    timing
        Processor times, CSV; of seeds identified side by side, their mean.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    case, method = settings["case"], settings["method"]
    posed = case_problem(settings, calibrated)
    identify_many = identifier_of_many(method, settings)
    recorded = read_measurements(measurements, seeds)
    progress = Progress(f"{case}, {method}", len(seeds))
    together = METHODS[method].side_by_side
    records = []
    for group in (seeds[i : i + together] for i in range(0, len(seeds), together)):
        start = time.process_time()
        answers = identify_many(
            [posed.of(recorded.time_s, recorded.rotation_rad[seed]) for seed in group],
            [stream(settings["study_seed"], case, seed, method) for seed in group],
            progress.within,
        )
        cpu_s = (time.process_time() - start) / len(group)
        for seed, answer in zip(group, answers, strict=True):
            noise = None
            if recorded.target_rad is not None:
                noise = rms(recorded.rotation_rad[seed] - recorded.target_rad)
            records.append(
                Record(
                    case,
                    method,
                    seed,
                    posed.model,
                    posed.searched,
                    posed.fixed,
                    answer,
                    noise,
                    cpu_s,
                )
            )
            progress.done()
    write_identifications(output, records)
    write_histories(history, records)
    write_timings(timing, records)
