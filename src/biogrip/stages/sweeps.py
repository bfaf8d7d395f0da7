"""Points of a sweep: errors of what is identified, and the share of seeds in the true basin."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.fit.genome import nearest_encodable
from biogrip.judging.likelihood import bounds_percent, headlines
from biogrip.judging.quantities import Quantity
from biogrip.physics.noise import rms
from biogrip.physics.simulation import simulated_response
from biogrip.records.identifications import near_noise, read_batch
from biogrip.records.rows import RowFile
from biogrip.study.study import Case, Study
from biogrip.study.sweeps import Point

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
