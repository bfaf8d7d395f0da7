"""Identification of the sample in noisy traces: by a method, and with every sample model.

A job has a batch of the seeds of a case. `identify_seeds` writes what a method finds in each trace,
with the history of its search; `join` puts the batches of a case together, a row per method and
seed, with what the genes could have held of each trace. `fit` writes the misfits of all sample
models, for model selection. Traces are fitted in groups, which are small enough for little memory;
results do not depend on the grouping.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

import biogrip_study.records.identifications as records
from biogrip.arrays import parts
from biogrip.files import read_table, write_rows
from biogrip.fit.experiment import Experiment
from biogrip.fit.nested_fits import fit_models
from biogrip.physics.noise import rms, stream
from biogrip.terminal import Progress
from biogrip_study.config.study import Case
from biogrip_study.methods.genome import lowest_encodable
from biogrip_study.methods.registry import identify_by
from biogrip_study.records.rows import join_arrays, read_arrays, write_arrays
from biogrip_study.records.traces import Measurements, read_measurements

_JOINT = 63


def seed_groups(seeds: Sequence[int]) -> Iterator[Sequence[int]]:
    """Return the seeds of a batch in groups."""
    return (seeds[some] for some in parts(len(seeds), _JOINT))


def identify_seeds(
    case: Case,
    method: str,
    seeds: Sequence[int],
    measurements: Path,
    parameters: Path,
    history: Path,
) -> None:
    """Identify a batch of seeds with one method.

    Parameters
    ----------
    case, method, seeds
        The case, the name of the method, and the seeds of the batch.
    measurements
        Their traces, npz.
    parameters, history
        Written: a row a seed, CSV, and one a generation, npz.
    """
    identified = partial(identify_by, method, case.block.method(method))
    recorded = read_measurements(measurements, list(seeds))
    experiment = experiment_for(case.experiment, recorded).to_identify()
    groups = [*seed_groups(seeds)]
    progress = Progress(f"{case.name}, {method}", len(groups))
    rows, histories = [], []
    for group in groups:
        traces = [recorded.readings[seed] for seed in group]
        rngs = [stream(case.study.config.study_seed, case.name, seed, method) for seed in group]
        problems = experiment.of_each(recorded.time_s, traces)
        answers = identified(problems, rngs, progress.within)
        for seed, trace, answer in zip(group, traces, answers, strict=True):
            noise = None if recorded.target is None else rms(trace - recorded.target)
            rows.append((case.name, method, seed, *records.row_of(experiment, answer, noise)))
            histories.append(records.history_of(method, seed, experiment, answer))
        progress.done()
    write_rows(parameters, records.identification_columns(experiment.model), rows)
    write_arrays(history, join_arrays(histories))


def join(
    case: Case,
    batches: list[Path],
    histories: list[Path],
    measurements: list[Path],
    identifications: Path,
    history: Path,
) -> None:
    """Join the batches of all methods, and add the lowest encodable misfit of each trace.

    It is looked for around the end of every run, since these surround the continuous optimum.
    """
    for batch in batches:
        records.read_batch(batch, case)
    rows = [row for batch in batches for row in read_table(batch)]
    searched = case.experiment.searched.parameters
    ends = defaultdict(list)
    for row in rows:
        ends[row["seed"]].append([float(row[p.column]) for p in searched])
    lowest: dict[str, str] = {}
    for file in measurements:
        recorded = read_measurements(file)
        experiment = experiment_for(case.experiment, recorded).to_identify()
        ranges = [experiment.ranges[parameter.range_name] for parameter in searched]
        traces = recorded.readings
        posed = experiment.of_each(recorded.time_s, [*traces.values()])
        for seed, of_trace in zip(map(str, traces), posed, strict=True):
            misfit = lowest_encodable(of_trace.residuals.misfit, ranges, np.array(ends[seed]))
            lowest[seed] = f"{misfit:.6e}"
    header = records.identification_columns(case.sample.model)
    joined = ([*map(row.get, header), lowest.get(row["seed"], "")] for row in rows)
    write_rows(identifications, (*header, records.ENCODABLE), joined)
    write_arrays(history, join_arrays([read_arrays(batch) for batch in histories]))


def fit(case: Case, seeds: Sequence[int], measurements: Path, fits: Path) -> None:
    """Fit a batch of seeds by least squares with each model.

    Parameters
    ----------
    case, seeds
        The case, and the seeds of the batch.
    measurements
        Their traces, npz.
    fits
        Written: a row per model and seed, CSV, see `MODEL_FITS`.
    """
    models = {name: sample.model for name, sample in case.models.items()}
    recorded = read_measurements(measurements, list(seeds))
    experiment = experiment_for(case.experiment, recorded).to_identify(*models.values())
    progress = Progress(f"{case.name}, models", len(models) * len(seeds))
    rows: list[tuple[str | int, ...]] = []
    for group in seed_groups(seeds):
        traces = experiment.of_each(recorded.time_s, [recorded.readings[seed] for seed in group])
        whose = case.study.config.study_seed, case.name
        posed = [
            {name: experiment.for_model(trace, model) for name, model in models.items()}
            for trace in traces
        ]
        rngs = [{name: stream(*whose, seed, f"model {name}") for name in models} for seed in group]
        done = partial(progress.done, len(group))
        fits_of_traces = fit_models(posed, case.block.least_squares, rngs, done)
        for name, model in models.items():
            sizes = len(model.names), len(recorded.time_s)
            rows += [
                (case.name, name, seed, *sizes, f"{answers[name].misfit:.8e}")
                for seed, answers in zip(group, fits_of_traces, strict=True)
            ]
    records.MODEL_FITS.write(fits, rows)


def experiment_for(experiment: Experiment, measurements: Measurements) -> Experiment:
    """Return the experiment that traces of a case are identified by: see `for_trace`."""
    if experiment.simulated:
        return experiment
    # Imported here: of a simulated trace nothing has to be judged.
    from biogrip.identify.prepare import for_trace

    return for_trace(experiment, measurements.recording)
