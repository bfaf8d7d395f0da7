"""Points of a sweep: errors of what is identified, and the share of seeds in the true basin.

`judge_points` writes them, a row per point, method and quantity; a table shows some.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import biogrip_study.records.identifications as records
from biogrip.arrays import BoolArray
from biogrip.judging.likelihood import bounds_percent, headlines
from biogrip.judging.quantities import Quantity, quantity_value
from biogrip.physics.noise import rms
from biogrip.physics.response import simulated_response
from biogrip_study.config.study import Case, Study
from biogrip_study.config.study_blocks import AxisBlock
from biogrip_study.methods.genome import nearest_encodable
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.rows import RowFile
from biogrip_study.tables.cases import error_percent
from biogrip_study.tables.layout import Column, Row, ShownTable

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
_FACTOR, _BOUNDS_OF_BASIN = math.log(2), 4.0


def judge_points(study: Study, sweep: str, identifications: list[Path], points: Path) -> None:
    """Compute errors and shares of successful seeds at every point of a sweep.

    Batches of identifications are in folders named like point and method.
    """
    block, rows = study.config.sweeps[sweep], list[tuple[str | int, ...]]()
    for name in block.cases:
        true, grid, bounds = study.cases[name].parameters, block.points(sweep, name), {}
        for point in grid:
            case = study.points[point.name]
            bounds[point.name] = bounds_percent(case.experiment, case.noise, true, case.times_s)
        heads = headlines(
            [(q.label, percent) for of_point in bounds.values() for q, percent in of_point]
        )
        for point, method in product(grid, study.config.methods):
            case = study.points[point.name]
            batches = [file for file in identifications if file.parts[-3:-1] == (case.name, method)]
            runs = pd.concat([records.read_batch(file, case) for file in batches])
            if case.noise.absent:
                # Without noise, the misfit of the true values rounded to the genes' digits.
                runs = runs.assign(noise_rms=_resolution(case, true))
            head = point.name, point.row.shown, point.column.shown, method
            judged = _judged(case, true, runs, bounds[point.name], heads)
            rows += ((*head, *numbers) for numbers in judged)
    POINTS.write(points, rows)


def _judged(
    point: Case,
    true: Mapping[str, float],
    runs: pd.DataFrame,
    bounds: list[tuple[Quantity, float]],
    heads: list[str],
) -> Iterator[tuple[str | int, ...]]:
    """Yield quantity, number of runs, shares, median errors and bound in percent."""
    found = records.values_by_quantity(runs, point.experiment.searched)
    inside = np.ones(len(runs), dtype=bool)
    for quantity, percent in bounds:
        if (label := quantity.label) in heads:
            inside &= in_basin(found[label], quantity_value(label, true), percent / 100)
    near = np.mean(records.near_noise(runs, point.study))
    shares = near, np.mean(inside) if heads else np.nan
    for quantity, percent in bounds:
        truth = quantity_value(quantity.label, true)
        errors = abs(error_percent(truth, found[quantity.label]))
        numbers = *shares, errors.median(), errors[inside].median(), percent
        yield quantity.label, len(runs), *("" if np.isnan(x) else f"{x:.6g}" for x in numbers)


def in_basin(values: Any, truth: float | None, bound: float) -> BoolArray:
    """Return True where identified values lie in the basin of the truth, (n_seeds,).

    The basin reaches to a factor of two or, where the noise allows no more, to four times the
    bound of the logarithm. Without noise the bound is NaN and the factor holds.
    """
    with np.errstate(divide="ignore"):
        away = np.abs(np.log(np.divide(values, truth or 0.0)))
    return np.asarray(away <= np.fmax(_FACTOR, _BOUNDS_OF_BASIN * bound))


def _resolution(point: Case, true: Mapping[str, float]) -> float:
    """Return the noise-free RMS misfit of the encodable parameters nearest to the truth."""
    experiment = point.experiment
    rounded = dict(true)
    for parameter in experiment.searched.parameters:
        genes = experiment.ranges[parameter.range_name]
        rounded[parameter.name] = nearest_encodable(true[parameter.name], genes)
    model, given = experiment.model, (experiment.torque, point.times_s)
    both = [model.sample(values) for values in (true, rounded)]
    return rms(np.subtract(*(simulated_response(experiment.gripper, of, *given) for of in both)))


# By column of points: name and heading of the columns that the table has for every method.
_BY_METHOD = {
    "near_noise_share": ("near_noise", "Share {near_noise}"),
    "basin_share": ("basin", "Share in the true basin"),
    "basin_error_percent": ("basin_error", "Median abs. error there %"),
    "median_absolute_error_percent": ("error", "Median abs. error of all %"),
}
# Errors, and the least that is told without noise, where rounding decides how a fit ends.
_ERRORS, _LEAST_PERCENT = [name for name in _BY_METHOD if "error" in name], 1.0
_CAPTION = (
    "{title}: of every case the best and the worst determined quantity. In the basin of the truth "
    "are seeds within a factor of two of it, or four times the bound if that is more, in both. "
    "Bound is the standard deviation that noise leaves at least, to first order and with "
    "parameters without information taken as known; the median absolute error of an estimator that "
    "attains it is 0.67 of that. Without noise, the misfit of the truth rounded to two digits "
    f"stands for the noise, and errors below {_LEAST_PERCENT:g} % are given as that: rounding "
    "decides where these fits end."
)


def robustness(study: Study, sweep: str, points: Path) -> ShownTable:
    """Return a row for each point of a sweep and the best and worst determined quantity."""
    block, frame = study.config.sweeps[sweep], POINTS.read(points)
    silent = frame["bound_percent"].isna()
    frame.loc[silent, _ERRORS] = frame.loc[silent, _ERRORS].clip(lower=_LEAST_PERCENT)
    rows: list[Row] = []
    for case, of_case in frame.groupby(frame["point"].str.partition("--")[0], sort=False):
        first = of_case[of_case["method"] == study.shown_method.name]
        for quantity in headlines([*zip(first["quantity"], first["bound_percent"], strict=True)]):
            chosen = of_case[of_case["quantity"] == quantity]
            for _, at_point in chosen.groupby("point", sort=False):
                row = {"case": case, **at_point.iloc[0]}
                for method, values in at_point.set_index("method").iterrows():
                    row |= {f"{to}_{method}": values[of] for of, (to, _) in _BY_METHOD.items()}
                rows.append(row)
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
            for ours, heading in _BY_METHOD.values()
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
