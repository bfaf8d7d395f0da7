"""Studies around a study: points of a sweep, and other readings of the paper.

`judge` reads what is identified at every point of a sweep, and writes the errors and the share of
seeds in the basin of the truth. `identify_readings` identifies the traces of a case by the
genetic algorithm under every reading of the paper.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.fit.genetic import identify_many
from biogrip.fit.genome import nearest_encodable
from biogrip.judging.likelihood import bounds_percent, headlines
from biogrip.judging.quantities import Quantity
from biogrip.keys import built
from biogrip.physics.noise import add_noise, rms, stream
from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip.physics.simulation import simulated_response
from biogrip.records.identifications import READINGS, near_noise, read_batch
from biogrip.records.rows import RowFile
from biogrip.records.traces import read_target
from biogrip.stages.identification import groups
from biogrip.stages.targets import response
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.source import overlaid
from biogrip.study.study import Case, Study
from biogrip.study.sweeps import Point
from biogrip.terminal import Progress

POINTS = RowFile(
    "a sweep",
    (
        *("point", "row", "column", "method", "quantity", "seeds"),
        *("near_noise_share", "basin_share"),
        *("median_absolute_error_percent", "basin_error_percent", "bound_percent"),
    ),
    words=("point", "row", "column", "method", "quantity"),
)

# Log factor, and multiple of the bound, within which a value is in the basin of the truth.
_FACTOR, _BOUNDS = math.log(2), 4.0


def judge(
    study: Study,
    sweep: str,
    identifications: list[Path],
    calibrated: list[Path],
    points: Path,
) -> None:
    """Compute errors and shares of successful seeds at every point of a sweep.

    Batches of identifications are in folders named like point and method, calibrations are named
    like their point.
    """
    files: dict[tuple[str, str], list[Path]] = {}
    for path in identifications:
        files.setdefault((path.parts[-3], path.parts[-2]), []).append(path)
    calibrations = {path.stem: [path] for path in calibrated}
    block = study.config.sweeps[sweep]
    each = (_rows(study, block.points(sweep, case), files, calibrations) for case in block.cases)
    POINTS.write(points, (row for rows in each for row in rows))


def _rows(
    study: Study,
    points: list[Point],
    files: Mapping[tuple[str, str], list[Path]],
    calibrations: Mapping[str, list[Path]],
) -> Iterator[tuple[str | int, ...]]:
    """Yield a row for every point of a case, method and quantity."""
    true = study.cases[points[0].case].parameters
    bounds = {}
    for point in points:
        case = study.points[point.name]
        problem = case.experiment.calibrated(calibrations.get(point.name, []))
        bounds[point.name] = bounds_percent(problem, case.noise, true, case.times_s)
    heads = headlines([(q.label, percent) for found in bounds.values() for q, percent in found])
    for point in points:
        case = study.points[point.name]
        for method in study.config.methods:
            batches = files[point.name, method]
            found = pd.concat([read_batch(path, case) for path in batches])
            if case.noise.absent:
                # Without noise, the misfit of the true values rounded to the genes' digits.
                found = found.assign(noise_rms=_resolution(case, true))
            near = float(np.mean(near_noise(found, study.near_noise_tolerance)))
            for judged in _judged(case, true, found, bounds[point.name], heads, near):
                yield point.name, point.row.shown, point.column.shown, method, *judged


def _judged(
    point: Case,
    true: Mapping[str, float],
    found: pd.DataFrame,
    bounds: list[tuple[Quantity, float]],
    heads: list[str],
    near: float,
) -> Iterator[tuple[str | int, ...]]:
    """Yield what one method finds at a point, for every quantity."""
    searched = point.experiment.searched.parameters
    members = {q.label: [searched[index] for index in q.members] for q, _ in bounds}
    truths = {label: sum(true[p.name] for p in of) for label, of in members.items()}
    values = {
        label: found[[p.column for p in of]].sum(axis=1).to_numpy(float)
        for label, of in members.items()
    }
    inside = np.ones(len(found), dtype=bool)
    for q, percent in bounds:
        if q.label in heads:
            inside &= in_basin(values[q.label], truths[q.label], percent / 100)
    for q, percent in bounds:
        truth = truths[q.label]
        errors = 100 * np.abs(values[q.label] - truth) / (truth or np.nan)
        medians = [np.median(some) if len(some) else np.nan for some in (errors, errors[inside])]
        share = float(np.mean(inside)) if heads else np.nan
        numbers = (near, share, *medians, percent)
        yield q.label, len(found), *("" if np.isnan(it) else f"{it:.6g}" for it in numbers)


def in_basin(values: Array, truth: float, bound: float) -> BoolArray:
    """Return True where identified values lie in the basin of the truth, (n_seeds,).

    The basin reaches to a factor of two or, where the noise allows no more, to four times the
    bound of the logarithm. Without noise the bound is NaN and the factor holds.
    """
    with np.errstate(divide="ignore"):
        away = np.abs(np.log(values / truth))
    return away <= np.fmax(_FACTOR, _BOUNDS * bound)


def _resolution(point: Case, true: Mapping[str, float]) -> float:
    """Return the noise-free RMS misfit of the encodable parameters nearest to the truth."""
    problem = point.experiment
    time_s = point.times_s
    truth = [true[p.name] for p in problem.model.parameters]
    rounded = [
        problem.fixed.get(p.name, nearest_encodable(value, problem.ranges[p.range_name]))
        for p, value in zip(problem.model.parameters, truth, strict=True)
    ]
    both = simulated_response(
        problem.gripper,
        problem.model.network(np.array([truth, rounded])),
        problem.torque,
        time_s,
        nonlinear=False,
    )
    return rms(both[1] - both[0])


def identify_readings(case: Case, target: Path, rows: Path) -> None:
    """Identify every noisy trace of a case under every reading by the genetic algorithm.

    Random streams are those of the study, so a reading that changes nothing reproduces the
    study's results.
    """
    READINGS.write(rows, _reading_rows(case, target))


def _reading_rows(case: Case, target: Path) -> Iterator[tuple[str | int, ...]]:
    time_s, _, rotation = read_target(target, case.times_s)
    readings = case.study.config.readings
    progress = Progress(f"{case.name}, readings", len(readings) * case.seeds)
    for name, reading in readings.items():
        block = built(CaseBlock, overlaid(case.plain, reading.changes))
        read = replace(case, block=block)
        experiment, at, clean = read.experiment, time_s, rotation
        if read.samples != len(time_s):
            at, (clean, _) = read.times_s, response(read, read.times_s)
        for seeds in groups(range(case.seeds)):
            noises, searches = (
                [stream(case.study.study_seed, case.name, seed, purpose) for seed in seeds]
                for purpose in ("noise", "genetic")
            )
            traces = [add_noise(clean, read.noise, rng, at) for rng in noises]
            problems = experiment.of_each(at, traces)
            answers = identify_many(problems, block.genetic_algorithm, searches)
            for seed, trace, answer in zip(seeds, traces, answers, strict=True):
                names = experiment.searched.names
                values = {**experiment.fixed, **dict(zip(names, answer.parameters, strict=True))}
                falls = np.flatnonzero(np.diff(answer.history.best_misfit) < 0)
                yield (
                    *(case.name, name, seed),
                    *(f"{values.get(p.name, 0.0):.6g}" for p in SINGLE_BRANCH),
                    *(f"{answer.misfit:.6e}", f"{rms(trace - clean):.6e}", answer.generations),
                    int(falls[-1]) + 1 if len(falls) else 0,
                )
            progress.done(len(seeds))
