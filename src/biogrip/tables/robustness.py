"""Results of a sweep: the settings that its table and heat maps share, and the table."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from biogrip.fit.methods import Method, near_noise_words
from biogrip.judging.fisher import headlines
from biogrip.stages.sweeps import POINTS
from biogrip.study.study import Study
from biogrip.study.sweeps import AxisBlock
from biogrip.tables.layout import Column, Row, Table


@dataclass(frozen=True)
class ShownAxis:
    """An axis of a sweep as it is shown."""

    title: str
    """Title with the unit, marked if the paper does not give the values."""
    values: Mapping[str, str]
    """Values as shown, by their text in files."""


@dataclass(frozen=True)
class HeatMaps:
    """Titles, axes and tolerances of a sweep's table and heat maps."""

    name: str
    """Name of the sweep."""
    title: str
    """Title of the sweep."""
    cases: Mapping[str, str]
    """Titles of the cases, by name."""
    methods: Mapping[str, Method]
    """Identifiers by name."""
    rows: ShownAxis
    columns: ShownAxis
    near_noise_tolerance: float
    """Share by which a misfit may exceed the noise to count as near it."""
    reconstructed: tuple[str, ...]
    """Keys of the gripper that the paper does not give."""


def heat_maps(study: Study, name: str) -> HeatMaps:
    """Return the settings that the table and the heat maps of a sweep depend on."""
    sweep = study.sweeps[name]
    return HeatMaps(
        name,
        sweep.title or name,
        {case: study.cases[case].title for case in sweep.cases},
        study.identifiers,
        _shown(study, sweep.rows),
        _shown(study, sweep.columns),
        study.near_noise_tolerance,
        tuple(key for key in study.reconstructed if key.split(".")[0] == "gripper"),
    )


def _shown(study: Study, axis: AxisBlock) -> ShownAxis:
    keys = {f"{key}." for value in axis.levels for key in value.overrides}
    reconstructed = tuple(f"{name}." for name in study.reconstructed)
    title = axis.title + ", reconstructed" * any(key.startswith(reconstructed) for key in keys)
    return ShownAxis(title, {value.text: value.shown for value in axis.levels})


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


def robustness(maps: HeatMaps, points: Path) -> Table:
    """Join the points of a sweep over all its cases."""
    rows: list[Row] = []
    for name in maps.cases:
        found = read_points(points, maps.name, name)
        for quantity in headlines_of(found):
            chosen = found[found["quantity"] == quantity]
            for (row, column), group in chosen.groupby(["row", "column"], sort=False):
                by_method = group.set_index("method")
                head = {
                    "case": name,
                    "row": maps.rows.values[row],
                    "column": maps.columns.values[column],
                    "quantity": quantity,
                    "bound_percent": float(by_method["bound_percent"].iloc[0]),
                }
                rows.append(
                    head
                    | {
                        f"{ours}_{method}": float(by_method.loc[method, theirs])
                        for theirs, (ours, _) in _BY_METHOD.items()
                        for method in maps.methods
                    }
                )
    words = near_noise_words(maps.near_noise_tolerance)
    columns = (
        Column("case", "Case"),
        Column("row", _capital(maps.rows.title)),
        Column("column", _capital(maps.columns.title)),
        Column("quantity", "Quantity"),
        *(
            Column(f"{name}_{m}", f"{heading.format(near_noise=words)}, {method.title}", 2)
            for name, heading in _BY_METHOD.values()
            for m, method in maps.methods.items()
        ),
        Column("bound_percent", "Bound, rest known %", 2),
    )
    caption = (
        f"{maps.title}: of every case the best and the worst determined quantity. In the basin of "
        "the truth are seeds within a factor of two of it, or four times the bound if that is "
        "more, in both. Bound is the standard deviation that noise leaves at least, to first order "
        "and with parameters without information taken as known; the median absolute error of an "
        "estimator that attains it is 0.67 of that. Without noise, the misfit of the truth rounded "
        "to two digits stands for the noise."
    )
    if maps.reconstructed:
        caption += (
            f" Reconstructed, as the paper does not give them: {', '.join(maps.reconstructed)}."
        )
    return Table(caption, columns, rows)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
