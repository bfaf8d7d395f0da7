"""How well a case is identified from point to point of a sweep."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.noise import Noise, rms
from biogrip.experiment.sampling import Sampling
from biogrip.identifiability.at_truth import bounds_percent
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.genome import nearest_encodable
from biogrip.identify.success import near_noise
from biogrip.products.files.identifications import PATH, read_identifications
from biogrip.products.files.rows import RowFile
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads, Weight
from biogrip.response.simulation import simulated_rotation
from biogrip.study.study import Study

POINTS = RowFile(
    "a sweep",
    (
        *("point", "row", "column", "method", "quantity", "seeds"),
        *("success_share", "median_absolute_error_percent", "bound_percent"),
    ),
    "results/robustness/{sweep}/{case}.csv",
    words=("row", "column"),
)


@dataclass(frozen=True)
class PointSettings:
    """A point of a sweep.

    Parameters
    ----------
    row, column
        What is different, as files have it.
    problem
        What the identification assumes.
    noise, sampling
        What the trace is like.
    """

    row: str
    column: str
    problem: CaseProblem
    noise: Noise
    sampling: Sampling


@dataclass(frozen=True)
class Settings:
    """What a sweep over a case is judged by.

    Parameters
    ----------
    methods
        Identifiers.
    near_noise_tolerance
        By which share a misfit may exceed the noise, to be taken for as good.
    parameters
        True values by name, SI units.
    points
        By name.
    """

    methods: tuple[str, ...]
    near_noise_tolerance: float
    parameters: Mapping[str, float]
    points: Mapping[str, PointSettings]


def settings(study: Study, job: Wildcards) -> Settings:
    """Choose what a sweep over a case is judged by."""
    points = {}
    for point in study.sweeps[job["sweep"]].points(job["case"]):
        case = study.points[point.name]
        points[point.name] = PointSettings(
            point.row.text, point.column.text, case.problem, case.noise, case.sampling
        )
    parameters = study.cases[job["case"]].parameters
    return Settings(tuple(study.methods), study.near_noise_tolerance, parameters, points)


def judge(settings: Settings, identifications: list[Path], points: Path) -> None:
    """Judge the identifications of every point of a sweep over a case.

    Parameters
    ----------
    settings
        By what.
    identifications
        Those of every point, CSV, named like it.
    points
        A row per point, method and quantity, CSV.

    Raises
    ------
    BiogripError
        If a point has no identifications.
    """
    POINTS.write(points, _rows(settings, {path.stem: path for path in identifications}))


def _rows(settings: Settings, files: Mapping[str, Path]) -> Iterator[tuple[str | int, ...]]:
    for name, point in settings.points.items():
        if name not in files:
            raise BiogripError(f"{name}: no file of identifications is given.")
        for found in _judged(settings, point, files[name]):
            yield name, point.row, point.column, *found


def _judged(
    settings: Settings, point: PointSettings, path: Path
) -> Iterator[tuple[str | int, ...]]:
    """Judge one point, for every method and quantity."""
    problem, parameters = point.problem, settings.parameters
    time_s = point.sampling.over(problem.torque.end_s)
    bounds = bounds_percent(problem, point.noise, parameters, time_s)
    searched = problem.searched.parameters
    for method in settings.methods:
        found = read_identifications(path, method)
        share = float(np.mean(_succeeded(settings, point, time_s, found)))
        for q, percent in bounds:
            members = [searched[index] for index in q.members]
            truth = sum(parameters[p.name] for p in members)
            values = found[[p.column for p in members]].sum(axis=1).to_numpy(float)
            error = 100 * np.median(np.abs(values - truth)) / truth if truth else np.nan
            numbers = (_text(number) for number in (share, float(error), percent))
            yield method, q.label, len(found), *numbers


def _succeeded(
    settings: Settings, point: PointSettings, time_s: Array, found: pd.DataFrame
) -> np.ndarray:
    """Whether each seed reached the noise floor, (n_seeds,).

    Where there is no noise, the floor is what the genome can do: the misfit of the
    truth when it is rounded to two digits.
    """
    if point.noise.level == 0:
        floor = _resolution_rad(point.problem, settings.parameters, time_s)
        found = found.assign(noise_rms_rad=floor)
    return near_noise(found, settings.near_noise_tolerance)


def _resolution_rad(problem: CaseProblem, parameters: Mapping[str, float], time_s: Array) -> float:
    """RMS misfit, without noise, of the encodable parameters that are nearest to the truth."""
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


def _jobs(plan: Plan) -> list[Wildcards]:
    sweeps = plan.study.sweeps.values()
    return [{"sweep": sweep.name, "case": case} for sweep in sweeps for case in sweep.cases]


def _identifications(plan: Plan, job: Wildcards) -> list[str]:
    points = plan.study.sweeps[job["sweep"]].points(job["case"])
    return [PATH.format(case=point.name) for point in points]


SWEEP_POINTS = Product(
    "sweep_points",
    {"points": POINTS.path},
    judge,
    settings,
    _jobs,
    message="Judging the sweep {sweep} over {case}",
    reads={"identifications": Reads(_identifications)},
    weight=Weight(30, 1000),
)
