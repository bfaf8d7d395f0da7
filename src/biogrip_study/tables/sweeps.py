"""Points of a sweep: errors of what is identified, and the share of seeds in the true basin.

`judge_points` writes them, a row per point, method and quantity; a table shows some.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.judging.likelihood import bounds_percent, headlines
from biogrip.judging.quantities import Quantity
from biogrip.physics.noise import rms
from biogrip.physics.simulation import simulated_response
from biogrip_study.config.study import Case, Study
from biogrip_study.config.study_blocks import AxisBlock
from biogrip_study.gripper.calibration import with_calibration
from biogrip_study.methods.genome import nearest_encodable
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.identifications import near_noise, near_noise_words, read_batch
from biogrip_study.records.rows import RowFile
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


def judge_points(
    study: Study, sweep: str, identifications: list[Path], calibrated: list[Path], points: Path
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
    rows: list[tuple[str | int, ...]] = []
    for name in block.cases:
        true, grid, bounds = study.cases[name].parameters, block.points(sweep, name), {}
        for point in grid:
            case = study.points[point.name]
            problem = with_calibration(case.experiment, calibrations.get(point.name, []))
            bounds[point.name] = bounds_percent(problem, case.noise, true, case.times_s)
        heads = headlines(
            [(q.label, percent) for of_point in bounds.values() for q, percent in of_point]
        )
        for point, method in product(grid, study.config.methods):
            case = study.points[point.name]
            runs = pd.concat([read_batch(path, case) for path in files[point.name, method]])
            if case.noise.absent:
                # Without noise, the misfit of the true values rounded to the genes' digits.
                runs = runs.assign(noise_rms=_resolution(case, true))
            near = float(np.mean(near_noise(runs, study.near_noise_tolerance)))
            head = point.name, point.row.shown, point.column.shown, method
            judged = _judged(case, true, runs, bounds[point.name], heads, near)
            rows += ((*head, *numbers) for numbers in judged)
    POINTS.write(points, rows)


def _judged(
    point: Case,
    true: Mapping[str, float],
    runs: pd.DataFrame,
    bounds: list[tuple[Quantity, float]],
    heads: list[str],
    near: float,
) -> Iterator[tuple[str | int, ...]]:
    searched = point.experiment.searched.parameters
    errors, inside = {}, np.ones(len(runs), dtype=bool)
    for q, percent in bounds:
        members = [searched[index] for index in q.members]
        truth = sum(true[p.name] for p in members)
        values = runs[[p.column for p in members]].sum(axis=1).to_numpy(float)
        errors[q.label] = 100 * np.abs(values - truth) / (truth or np.nan)
        if q.label in heads:
            inside &= in_basin(values, truth, percent / 100)
    for q, percent in bounds:
        every = errors[q.label]
        medians = [np.median(some) if len(some) else np.nan for some in (every, every[inside])]
        share = float(np.mean(inside)) if heads else np.nan
        numbers = (near, share, *medians, percent)
        yield q.label, len(runs), *("" if np.isnan(x) else f"{x:.6g}" for x in numbers)


def in_basin(values: Array, truth: float, bound: float) -> BoolArray:
    """Return True where identified values lie in the basin of the truth, (n_seeds,).

    The basin reaches to a factor of two or, where the noise allows no more, to four times the
    bound of the logarithm. Without noise the bound is NaN and the factor holds.
    """
    with np.errstate(divide="ignore"):
        away = np.abs(np.log(values / truth))
    return away <= np.fmax(_FACTOR, _BOUNDS_OF_BASIN * bound)


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
    )
    return rms(both[1] - both[0])


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
    frame["case"] = frame["point"].str.partition("--")[0]
    silent = frame["bound_percent"].isna()
    frame.loc[silent, _ERRORS] = frame.loc[silent, _ERRORS].clip(lower=_LEAST_PERCENT)
    rows: list[Row] = []
    for case in block.cases:
        of_case = frame[frame["case"] == case]
        first = of_case[of_case["method"] == study.shown_method.name]
        for quantity in headlines([*zip(first["quantity"], first["bound_percent"], strict=True)]):
            chosen = of_case[of_case["quantity"] == quantity]
            for _, at_point in chosen.groupby("point", sort=False):
                row = at_point.iloc[0][["case", "row", "column", "quantity", "bound_percent"]]
                by_method = {
                    f"{ours}_{method}": values[theirs]
                    for method, values in at_point.set_index("method").iterrows()
                    for theirs, (ours, _) in _BY_METHOD.items()
                }
                rows.append(row.to_dict() | by_method)
    words = near_noise_words(study.near_noise_tolerance)
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
