"""Groups of traces that are fitted together, small enough for little memory.

Stage 3: identification of the sample's parameters in each noisy trace.

Stage 4: identifications of a case joined from batches, a row per method and seed.

Stage 4: fits of every sample model to every trace, for model selection.
"""

import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from biogrip.arrays import parts
from biogrip.errors import BiogripError
from biogrip.files import atomic_write
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.methods import identifier
from biogrip.fit.nested_fits import fit_models
from biogrip.physics.noise import rms, stream
from biogrip.progress import Progress
from biogrip.records.identifications import (
    MODEL_FITS,
    Record,
    columns,
    write_histories,
    write_identifications,
    write_timings,
)
from biogrip.records.rows import read_rows, write_rows
from biogrip.records.traces import Measurements, read_measurements
from biogrip.study.study import Case

_JOINT = 63


def groups(seeds: Sequence[int], times: int = 1) -> Iterator[Sequence[int]]:
    """Return the seeds of a batch in groups; results do not depend on the grouping."""
    return (seeds[some] for some in parts(len(seeds), times * _JOINT))


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
        problems = case_problem.of_each(recorded.time_s, traces)
        answers = identified(problems, rngs, progress.within)
        cpu_s = (time.process_time() - start) / len(group)
        for seed, trace, answer in zip(group, traces, answers, strict=True):
            noise = None if recorded.target_rad is None else rms(trace - recorded.target_rad)
            records.append(Record(*whose, seed, answer, noise, cpu_s))
        progress.done(len(group))
    write_identifications(parameters, records)
    write_histories(history, records)
    write_timings(timing, records)


def join(
    case: Case,
    batches: list[Path],
    history_batches: list[Path],
    parameters: Path,
    history: Path,
) -> None:
    """Join batches in the order of their methods and seeds.

    Raises
    ------
    BiogripError
        If a seed is missing or occurs twice.
    """
    header = columns(case.sample.model)
    rows = [row for batch in batches for row in read_rows(batch, header)[1:]]
    rows = [row for row in rows if int(row[2]) < case.seeds]
    seeds = range(case.seeds)
    if [(row[1], int(row[2])) for row in rows] != [
        (m, s) for m in case.study.methods for s in seeds
    ]:
        names = ", ".join(str(batch) for batch in batches)
        raise BiogripError(
            f"{names}: do not hold each of the seeds 0 to {seeds[-1]} once for each of "
            f"{', '.join(case.study.methods)}. Delete them and run again."
        )
    write_rows(parameters, header, rows)
    with atomic_write(history) as scratch:
        schema = pq.read_schema(history_batches[0])
        with pq.ParquetWriter(scratch, schema) as joined:
            for batch in history_batches:
                # The data set API would import pandas.
                with pq.ParquetFile(batch) as file:
                    table = file.read()
                joined.write_table(table.filter(pc.less(table["seed"], case.seeds)))


def _problem(case: Case) -> CaseProblem:
    return case.problem.to_identify(*(sample.model for sample in case.models.values()))


def fit(
    case: Case,
    seeds: Sequence[int],
    measurements: Path,
    calibrated: list[Path],
    fits: Path,
) -> None:
    """Fit a batch of seeds by least squares with each model."""
    case_problem = _problem(case).calibrated(calibrated)
    recorded = read_measurements(measurements, list(seeds))
    weighted = case_problem.weighted(recorded.sd_rad)
    MODEL_FITS.write(fits, _rows(case, weighted, seeds, recorded))


def _rows(
    case: Case, case_problem: CaseProblem, seeds: Sequence[int], recorded: Measurements
) -> Iterator[tuple[str | int, ...]]:
    samples, study_seed = len(recorded.time_s), case.study.study_seed
    progress = Progress(f"{case.name}, models", len(case.models) * len(seeds))
    rows: dict[str, list[tuple[str | int, ...]]] = {name: [] for name in case.models}
    for group in groups(seeds):
        rotations = (recorded.rotation_rad[seed] for seed in group)
        traces = case_problem.of_each(recorded.time_s, rotations)
        models = {name: sample.model for name, sample in case.models.items()}
        found = fit_models(
            {
                name: [case_problem.for_model(trace, model) for trace in traces]
                for name, model in models.items()
            },
            case.least_squares,
            {
                name: [stream(study_seed, case.name, seed, f"model {name}") for seed in group]
                for name in models
            },
            partial(progress.done, len(group)),
        )
        for name, answers in found.items():
            rows[name] += [
                (
                    case.name,
                    name,
                    seed,
                    len(models[name].names),
                    samples,
                    f"{answer.misfit_rad:.8e}",
                )
                for seed, answer in zip(group, answers, strict=True)
            ]
    for of_model in rows.values():
        yield from of_model
