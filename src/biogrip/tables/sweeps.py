"""Results of sweeps, in a table that shares its numbers with the heat maps."""

from pathlib import Path

import pandas as pd

from biogrip.judging.likelihood import headlines
from biogrip.records.identifications import near_noise_words
from biogrip.stages.sweeps import POINTS
from biogrip.study.study import Study
from biogrip.study.sweeps import AxisBlock
from biogrip.tables.layout import Column, Row, ShownTable


def axis_title(study: Study, axis: AxisBlock) -> str:
    """Return the title of an axis with its unit, marked if the paper does not give the values."""
    keys = {f"{key}." for value in axis.levels for key in value.overrides}
    reconstructed = tuple(f"{name}." for name in study.config.reconstructed)
    return axis.title + ", reconstructed" * any(key.startswith(reconstructed) for key in keys)


def read_points(path: Path, sweep: str, case: str) -> pd.DataFrame:
    """Read the judged points of a case in a sweep."""
    found = POINTS.read(path)
    return found[found["point"].str.startswith(f"{case}--{sweep}--")]


def headlines_of(points: pd.DataFrame) -> list[str]:
    """Return the best and the worst determined quantity of a case, see `headlines`."""
    first = points[points["method"] == points["method"].iloc[0]]
    pairs = zip(first["quantity"], first["bound_percent"].astype(float), strict=True)
    return headlines(list(pairs))


# By column of points: name and heading of the columns that the table has for every method.
_BY_METHOD = {
    "near_noise_share": ("near_noise", "Share {near_noise}"),
    "basin_share": ("basin", "Share in the true basin"),
    "basin_error_percent": ("basin_error", "Median abs. error there %"),
    "median_absolute_error_percent": ("error", "Median abs. error of all %"),
}
# Errors, and the least that is told without noise, where rounding decides how a fit ends.
_ERRORS, _LEAST_PERCENT = [name for name in _BY_METHOD if "error" in name], 1.0


def robustness(study: Study, name: str, points: Path) -> ShownTable:
    """Join the points of a sweep over all its cases."""
    sweep, methods = study.config.sweeps[name], study.identifiers
    rows: list[Row] = []
    for case in sweep.cases:
        found = read_points(points, name, case)
        for quantity in headlines_of(found):
            chosen = found[found["quantity"] == quantity]
            for (row, column), group in chosen.groupby(["row", "column"], sort=False):
                by_method = group.set_index("method")
                if by_method["bound_percent"].isna().all():
                    by_method[_ERRORS] = by_method[_ERRORS].clip(lower=_LEAST_PERCENT)
                head = {
                    "case": case,
                    "row": row,
                    "column": column,
                    "quantity": quantity,
                    "bound_percent": float(by_method["bound_percent"].iloc[0]),
                }
                rows.append(
                    head
                    | {
                        f"{ours}_{method}": float(by_method.loc[method, theirs])
                        for theirs, (ours, _) in _BY_METHOD.items()
                        for method in methods
                    }
                )
    words = near_noise_words(study.near_noise_tolerance)
    columns = (
        Column("case", "Case"),
        Column("row", _title(study, sweep.rows)),
        Column("column", _title(study, sweep.columns)),
        Column("quantity", "Quantity"),
        *(
            Column(f"{ours}_{method}", f"{heading.format(near_noise=words)}, {it.title}", 2)
            for ours, heading in _BY_METHOD.values()
            for method, it in methods.items()
        ),
        Column("bound_percent", "Bound, rest known %", 2),
    )
    caption = (
        f"{sweep.title or name}: of every case the best and the worst determined quantity. In the "
        "basin of the truth are seeds within a factor of two of it, or four times the bound if "
        "that is more, in both. Bound is the standard deviation that noise leaves at least, to "
        "first order and with parameters without information taken as known; the median absolute "
        "error of an estimator that attains it is 0.67 of that. Without noise, the misfit of the "
        "truth rounded to two digits stands for the noise, and errors below "
        f"{_LEAST_PERCENT:g} % are given as that: rounding decides where these fits end."
    )
    marked = [key for key in study.config.reconstructed if key.split(".")[0] == "gripper"]
    if marked:
        caption += f" Reconstructed, as the paper does not give them: {', '.join(marked)}."
    return ShownTable(caption, columns, rows)


def _title(study: Study, axis: AxisBlock) -> str:
    title = axis_title(study, axis)
    return title[:1].upper() + title[1:]
