"""Stage 3: identification of the sample's parameters in each noisy trace."""

import time
from collections.abc import Sequence
from pathlib import Path

from biogrip.experiment.noise import rms
from biogrip.experiment.random_streams import stream
from biogrip.fit.identifier import identifier
from biogrip.progress import Progress
from biogrip.records.identifications import (
    Record,
    write_histories,
    write_identifications,
    write_timings,
)
from biogrip.records.traces import read_measurements
from biogrip.stages.groups import groups
from biogrip.study.study import Case


def identify(
    case: Case,
    method: str,
    seeds: Sequence[int],
    measurements: Path,
    calibrated: list[Path],
    parameters: Path,
    history: Path,
    timing: Path,
) -> None:
    """Identify a batch of seeds with one method; traces identified together share their time."""
    case_problem = case.problem.to_identify().calibrated(calibrated)
    identified = identifier(method, case.method(method))
    recorded = read_measurements(measurements, list(seeds))
    case_problem = case_problem.weighted(recorded.sd_rad)
    progress = Progress(f"{case.name}, {method}", len(seeds))
    whose = case.name, method, case_problem.model, case_problem.searched, case_problem.fixed
    records = []
    for group in groups(seeds):
        traces = [recorded.rotation_rad[seed] for seed in group]
        rngs = [stream(case.study.study_seed, case.name, seed, method) for seed in group]
        start = time.process_time()
        problems = [case_problem.of(recorded.time_s, trace) for trace in traces]
        answers = identified(problems, rngs, progress.within)
        cpu_s = (time.process_time() - start) / len(group)
        for seed, trace, answer in zip(group, traces, answers, strict=True):
            noise = None if recorded.target_rad is None else rms(trace - recorded.target_rad)
            records.append(Record(*whose, seed, answer, noise, cpu_s))
        progress.done(len(group))
    write_identifications(parameters, records)
    write_histories(history, records)
    write_timings(timing, records)
