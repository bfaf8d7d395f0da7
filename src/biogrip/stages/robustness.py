"""How well a case is identified from point to point of a sweep."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import written_whole
from biogrip.identifiability.at_truth import bounds_percent
from biogrip.identify.genome import nearest_encodable
from biogrip.identify.identifications import at_noise_floor, read_identifications
from biogrip.measurement import rms
from biogrip.response.simulation import simulated_rotation
from biogrip.sample import SampleModel
from biogrip.study import build

COLUMNS = (
    *("point", "row", "column", "method", "quantity", "seeds"),
    *("success_share", "median_absolute_error_percent", "bound_percent"),
)


def run(settings: dict[str, Any], identifications: list[Path], output: Path) -> None:
    """Judge the identifications of every point of a sweep over a case.

    Parameters
    ----------
    settings
        ``methods``, ``noise_floor_tolerance``, ``parameters`` (the true ones), and
        ``points`` by name. Of each point, there or for all of them: ``row``,
        ``column``, ``gripper``, ``protocol`` (and ``actuator``, if that is in volts),
        ``sampling``, ``noise``, ``model``, ``branches``, ``fixed``, ``nonlinear``,
        ``search_range``.
    identifications
        Those of every point, CSV, named like it.
    output
        A row per point, method and quantity, CSV.

    Raises
    ------
    BiogripError
        If a point has no identifications.
    """
    files = {path.stem: path for path in identifications}
    rows = []
    for name, point in settings["points"].items():
        if name not in files:
            raise BiogripError(f"{name}: no file of identifications is given.")
        whole = {**settings, **point}
        rows += [
            (name, whole["row"], whole["column"], *found) for found in _judged(whole, files[name])
        ]
    with written_whole(output) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)


def _judged(point: dict[str, Any], path: Path) -> list[tuple[str | int, ...]]:
    """Judge one point, for every method and quantity."""
    model = build.sample_model(point)
    time_s = build.sampling(point["sampling"], build.torque(point).end_s)
    bounds = bounds_percent(point, point["parameters"], time_s)
    searched = [p for p in model.parameters if p.name not in point["fixed"]]
    rows: list[tuple[str | int, ...]] = []
    for method in point["methods"]:
        found = read_identifications(path, method)
        share = float(np.mean(_succeeded(point, model, time_s, found)))
        for q, percent in bounds:
            members = [searched[index] for index in q.members]
            truth = sum(point["parameters"][p.name] for p in members)
            values = found[[p.column for p in members]].sum(axis=1).to_numpy(float)
            error = 100 * np.median(np.abs(values - truth)) / truth if truth else np.nan
            numbers = (_text(number) for number in (share, float(error), percent))
            rows.append((method, q.label, len(found), *numbers))
    return rows


def _succeeded(
    point: dict[str, Any], model: SampleModel, time_s: Array, found: pd.DataFrame
) -> np.ndarray:
    """Whether each seed reached the noise floor, (n_seeds,).

    Where there is no noise, the floor is what the genome can do: the misfit of the
    truth when it is rounded to two digits.
    """
    if point["noise"]["level"] == 0:
        found = found.assign(noise_rms_rad=_resolution_rad(point, model, time_s))
    return at_noise_floor(found, point["noise_floor_tolerance"])


def _resolution_rad(point: dict[str, Any], model: SampleModel, time_s: Array) -> float:
    """RMS misfit, without noise, of the encodable parameters that are nearest to the truth."""
    ranges = build.gene_ranges(point["search_range"])
    truth = [point["parameters"][p.name] for p in model.parameters]
    rounded = [
        point["fixed"].get(p.name, nearest_encodable(value, ranges[p.range_name]))
        for p, value in zip(model.parameters, truth, strict=True)
    ]
    both = simulated_rotation(
        build.gripper(point["gripper"]),
        model.network(np.array([truth, rounded])),
        build.torque(point),
        time_s,
        nonlinear=point["nonlinear"],
    )
    return rms(both[1] - both[0])


def _text(number: float) -> str:
    return "" if np.isnan(number) else f"{number:.6g}"
