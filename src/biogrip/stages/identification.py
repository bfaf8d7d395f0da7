"""Stage 3: the sample's parameters from each noisy trace."""

import time
from pathlib import Path
from typing import Any

from biogrip.calibrated_gripper import read_calibrated_arms
from biogrip.identify.methods import identifier
from biogrip.identify.problem import problem_of
from biogrip.identify.records import (
    Record,
    write_histories,
    write_identifications,
    write_timings,
)
from biogrip.measurement import rms
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.sample import with_fixed
from biogrip.study import build
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
        ``study_seed``, ``case``, ``method``, ``gripper``, ``protocol`` (and
        ``actuator``, if that is in volts), ``model``, ``branches``, ``nonlinear``,
        ``offset``, ``drift``, ``fixed``, ``search_range``, and the method's blocks.
    seeds
        The batch.
    measurements
        Noisy traces, Parquet.
    output, history
        Identified parameters, CSV, and the way to them, Parquet.
    timing
        Processor times, CSV.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    case, method, fixed = settings["case"], settings["method"], settings["fixed"]
    model = build.sample_model(settings)
    searched = with_fixed(model, fixed)
    gripper = build.gripper(settings["gripper"])
    if calibrated is not None:
        gripper = read_calibrated_arms(calibrated, gripper)
    torque, ranges = build.torque(settings), build.gene_ranges(settings["search_range"])
    identify = identifier(method, settings)
    recorded = read_measurements(measurements, seeds)
    progress = Progress(f"{case}, {method}", len(seeds))
    records = []
    for seed in seeds:
        trace = recorded.rotation_rad[seed]
        start = time.process_time()
        problem = problem_of(
            gripper,
            searched,
            torque,
            recorded.time_s,
            trace,
            ranges,
            nonlinear=settings["nonlinear"],
            offset=settings["offset"],
            drift=settings["drift"],
        )
        rng = stream(settings["study_seed"], case, seed, method)
        answer = identify(problem, rng, progress.within)
        cpu_s = time.process_time() - start
        noise = None if recorded.target_rad is None else rms(trace - recorded.target_rad)
        records.append(Record(case, method, seed, model, searched, fixed, answer, noise, cpu_s))
        progress.done()
    write_identifications(output, records)
    write_histories(history, records)
    write_timings(timing, records)
