"""Points of a sweep: errors of what is identified, and the share of seeds in the true basin."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import biogrip.levels as levels
import biogrip_study.records.identifications as records
from biogrip.arrays import BoolArray
from biogrip.judging.likelihood import quantity_value
from biogrip.physics.noise import rms
from biogrip.physics.response import simulated_response
from biogrip_study.config.study import Case, Study
from biogrip_study.config.study_blocks import AxisBlock
from biogrip_study.methods.genome import nearest_encodable
from biogrip_study.methods.registry import METHODS
from biogrip_study.tables.cases import error_percent
from biogrip_study.tables.layout import Column, Row, ShownTable
from biogrip_study.tables.study import bounds_at_truth

# Log factor, and multiple of the bound, within which a value is in the basin of the truth.
_FACTOR, _BOUNDS_OF_BASIN = math.log(2), 4.0


def headlines(bounds: Sequence[tuple[str, float]]) -> list[str]:
    """Return the best and the worst determined quantity of several points, by label.

    Quantities count if their bound in percent, not NaN, is below `DETERMINED_PERCENT` at half of
    the points or more. Parts of a sum, which may trade against each other, do not count beside it.
    """
    percents = pd.DataFrame(bounds, columns=["label", "percent"]).dropna()
    medians = percents.groupby("label")["percent"].median().sort_values(kind="stable")
    parts = {part for label in medians.index if " + " in label for part in label.split(" + ")}
    determined = medians.index[medians < levels.DETERMINED_PERCENT].difference(parts, sort=False)
    return [*determined[:1], *determined[1:][-1:]]


def judge_point(
    case: Case, bounds: Mapping[str, float], heads: Sequence[str], identifications: Sequence[Path]
) -> dict[str, Row]:
    """Return what the table has of the headlined quantities of a point, by quantity.

    Given are the bounds of all quantities in percent, and identifications of all points.
    """
    told: dict[str, Row] = {q: {"quantity": q, "bound_percent": bounds[q]} for q in heads}
    for method in case.study.config.methods:
        batches = [file for file in identifications if file.parts[-3:-1] == (case.name, method)]
        runs = pd.concat([records.read_batch(file, case) for file in batches])
        if case.noise.absent:
            # Without noise, the misfit of the true values rounded to the genes' digits.
            runs = runs.assign(noise_rms=_resolution(case))
        values = records.values_by_quantity(runs, case.experiment.searched)
        truth = {q: quantity_value(q, case.parameters) for q in heads}
        inside = np.all([in_basin(values[q], truth[q], bounds[q] / 100) for q in heads], axis=0)
        least = _LEAST_PERCENT if case.noise.absent else 0.0
        for quantity, row in told.items():
            errors = abs(error_percent(truth[quantity], values[quantity]))
            row[f"near_noise_{method}"] = np.mean(records.near_noise(runs, case.study))
            row[f"basin_{method}"] = np.mean(inside)
            row[f"basin_error_{method}"] = np.maximum(errors[inside].median(), least)
            row[f"error_{method}"] = np.maximum(errors.median(), least)
    return told


def in_basin(values: Any, truth: float | None, bound: float) -> BoolArray:
    """Return True where identified values lie in the basin of the truth, (n_seeds,).

    The basin reaches to a factor of two or, where the noise allows no more, to four times the
    bound of the logarithm. Without noise the bound is NaN and the factor holds.
    """
    with np.errstate(divide="ignore"):
        away = np.abs(np.log(np.divide(values, truth or 0.0)))
    return np.asarray(away <= np.fmax(_FACTOR, _BOUNDS_OF_BASIN * bound))


def _resolution(point: Case) -> float:
    """Return the noise-free RMS misfit of the encodable parameters nearest to the truth."""
    experiment = point.experiment
    rounded = dict(point.parameters)
    for parameter in experiment.searched.parameters:
        genes = experiment.ranges[parameter.range_name]
        rounded[parameter.name] = nearest_encodable(rounded[parameter.name], genes)
    model, given = experiment.model, (experiment.torque, point.times_s)
    both = [model.sample(values) for values in (point.parameters, rounded)]
    return rms(np.subtract(*(simulated_response(experiment.gripper, of, *given) for of in both)))


# Column of every method, and its heading.
_BY_METHOD = {
    "near_noise": "Share {near_noise}",
    "basin": "Share in the true basin",
    "basin_error": "Median abs. error there %",
    "error": "Median abs. error of all %",
}
# The least error that is told without noise, where rounding decides how a fit ends.
_LEAST_PERCENT = 1.0
_CAPTION = (
    "{title}: of every case the best and the worst determined quantity. In the basin of the truth "
    "are seeds within a factor of two of it, or four times the bound if that is more, in both. "
    "Bound is the standard deviation that noise leaves at least, to first order and with "
    "parameters without information taken as known; the median absolute error of an estimator that "
    "attains it is 0.67 of that. Without noise, the misfit of the truth rounded to two digits "
    f"stands for the noise, and errors below {_LEAST_PERCENT:g} % are given as that: rounding "
    "decides where these fits end."
)


def robustness(study: Study, sweep: str, identifications: list[Path]) -> ShownTable:
    """Return a row for each point of a sweep and the best and worst determined quantity.

    Batches of identifications are in folders named like point and method.
    """
    block, rows = study.config.sweeps[sweep], list[Row]()
    for name in block.cases:
        grid = [(point, study.points[point.name]) for point in block.points(sweep, name)]
        bounds = [{q.label: bound for q, bound in bounds_at_truth(case)} for _, case in grid]
        heads = headlines([pair for of_point in bounds for pair in of_point.items()])
        judged = [
            judge_point(case, of_point, heads, identifications)
            for (_, case), of_point in zip(grid, bounds, strict=True)
        ]
        for quantity, ((point, _), told) in product(heads, zip(grid, judged, strict=True)):
            head = {"case": name, "row": point.row.shown, "column": point.column.shown}
            rows.append(head | told[quantity])
    words = records.near_noise_words(study)
    columns = (
        Column("case", "Case"),
        Column("row", _axis_heading(study, block.rows)),
        Column("column", _axis_heading(study, block.columns)),
        Column("quantity", "Quantity"),
        *(
            Column(
                f"{ours}_{method}",
                f"{heading.format(near_noise=words)}, {METHODS[method].title}",
                2,
            )
            for ours, heading in _BY_METHOD.items()
            for method in study.config.methods
        ),
        Column("bound_percent", "Bound, rest known %", 2),
    )
    caption = _CAPTION.format(title=block.title or sweep)
    marked = [key for key in study.config.reconstructed if key.split(".")[0] == "gripper"]
    if marked:
        caption += f" Reconstructed, as the paper does not give them: {', '.join(marked)}."
    return ShownTable(caption, columns, rows)


def _axis_heading(study: Study, axis: AxisBlock) -> str:
    """Return the title of an axis with its unit, marked if the paper does not give the values."""
    keys = {f"{key}." for value in axis.levels for key in value.overrides}
    reconstructed = tuple(f"{name}." for name in study.config.reconstructed)
    marked = ", reconstructed" * any(key.startswith(reconstructed) for key in keys)
    return axis.title[:1].upper() + axis.title[1:] + marked
