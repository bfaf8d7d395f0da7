"""Identification errors at every point of a sweep."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.errors import BiogripError
from biogrip.experiment.noise import rms
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.genome import nearest_encodable
from biogrip.fit.success import near_noise
from biogrip.judging.at_truth import bounds_percent, headlines
from biogrip.judging.quantities import Quantity
from biogrip.records.identifications import read_identifications
from biogrip.records.rows import RowFile
from biogrip.response.simulation import simulated_rotation
from biogrip.study.study import Case, Study

POINTS = RowFile(
    "a sweep",
    (
        *("point", "row", "column", "method", "quantity", "seeds"),
        *("near_noise_share", "basin_share"),
        *("median_absolute_error_percent", "basin_error_percent", "bound_percent"),
    ),
    "results/robustness/{sweep}/{case}.csv",
    words=("row", "column"),
)

# Log factor, and multiple of the bound, within which a value is in the basin of the truth.
_FACTOR, _BOUNDS = math.log(2), 4.0


@dataclass(frozen=True)
class SweepContent:
    """The sweep of a case."""

    study: Study
    """The study with the points as cases."""
    parameters: Mapping[str, float]
    """True values by name, SI units."""
    places: Mapping[str, tuple[str, str]]
    """Values on the axes by point, as text in files."""


def judge(
    sweep: SweepContent, identifications: list[Path], calibrated: list[Path], points: Path
) -> None:
    """Compute errors and shares of successful seeds at every point of a case's sweep.

    Files are named like their point.

    Raises
    ------
    BiogripError
        If a point has no identifications.
    """
    POINTS.write(points, _rows(sweep, {path.stem: path for path in identifications}, calibrated))


def _rows(
    sweep: SweepContent, files: Mapping[str, Path], calibrated: list[Path]
) -> Iterator[tuple[str | int, ...]]:
    calibrations = {path.stem: path for path in calibrated}
    bounds = {
        name: _bounds(sweep, point, [calibrations[name]] if name in calibrations else [])
        for name, point in sweep.study.points.items()
    }
    heads = headlines([(q.label, percent) for found in bounds.values() for q, percent in found])
    for name, point in sweep.study.points.items():
        if name not in files:
            raise BiogripError(f"{name}: no file of identifications is given.")
        for judged in _judged(sweep, point, files[name], bounds[name], heads):
            yield name, *sweep.places[name], *judged


def _bounds(
    sweep: SweepContent, point: Case, calibrated: list[Path]
) -> list[tuple[Quantity, float]]:
    problem = point.problem.calibrated(calibrated)
    time_s = point.sampling.over(problem.torque.end_s)
    return bounds_percent(problem, point.noise, sweep.parameters, time_s)


def _judged(
    sweep: SweepContent,
    point: Case,
    path: Path,
    bounds: list[tuple[Quantity, float]],
    heads: list[str],
) -> Iterator[tuple[str | int, ...]]:
    """Yield rows for one point, for every method and quantity."""
    problem, parameters = point.problem, sweep.parameters
    time_s = point.sampling.over(problem.torque.end_s)
    searched = problem.searched.parameters
    members = {q.label: [searched[index] for index in q.members] for q, _ in bounds}
    truths = {label: sum(parameters[p.name] for p in of) for label, of in members.items()}
    for method in sweep.study.methods:
        found = read_identifications(path, method)
        values = {
            label: found[[p.column for p in of]].sum(axis=1).to_numpy(float)
            for label, of in members.items()
        }
        near = float(np.mean(_succeeded(sweep, point, time_s, found)))
        inside = np.ones(len(found), dtype=bool)
        for q, percent in bounds:
            if q.label in heads:
                inside &= in_basin(values[q.label], truths[q.label], percent / 100)
        for q, percent in bounds:
            errors = _errors_percent(values[q.label], truths[q.label])
            within = _median(errors[inside])
            share = float(np.mean(inside)) if heads else np.nan
            numbers = (near, share, _median(errors), within, percent)
            yield method, q.label, len(found), *(_text(number) for number in numbers)


def in_basin(values: Array, truth: float, bound: float) -> BoolArray:
    """Return True where identified values lie in the basin of the truth, (n_seeds,).

    The basin reaches to a factor of two or, where the noise allows no more, to four times the
    bound of the logarithm. Without noise the bound is NaN and the factor holds.
    """
    with np.errstate(divide="ignore"):
        away = np.abs(np.log(values / truth))
    return away <= np.fmax(_FACTOR, _BOUNDS * bound)


def _errors_percent(values: Array, truth: float) -> Array:
    if not truth:
        return np.full(len(values), np.nan)
    return 100 * np.abs(values - truth) / truth


def _median(values: Array) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _succeeded(sweep: SweepContent, point: Case, time_s: Array, found: pd.DataFrame) -> np.ndarray:
    """Return True for each seed near the noise, (n_seeds,).

    Without noise, the misfit of the true values rounded to the genes' two digits takes its
    place.
    """
    if point.noise.absent:
        resolution = _resolution_rad(point.problem, sweep.parameters, time_s)
        found = found.assign(noise_rms=resolution)
    return near_noise(found, sweep.study.near_noise_tolerance)


def _resolution_rad(problem: CaseProblem, parameters: Mapping[str, float], time_s: Array) -> float:
    """Return the noise-free RMS misfit of the encodable parameters nearest to the truth."""
    truth = [parameters[p.name] for p in problem.model.parameters]
    rounded = [
        problem.fixed.get(p.name, nearest_encodable(value, problem.ranges[p.range_name]))
        for p, value in zip(problem.model.parameters, truth, strict=True)
    ]
    both = simulated_rotation(
        problem.gripper,
        problem.model.network(np.array([truth, rounded])),
        problem.torque,
        time_s,
        nonlinear=problem.nonlinear,
    )
    return rms(both[1] - both[0])


def _text(number: float) -> str:
    return "" if np.isnan(number) else f"{number:.6g}"
