"""What a sweep says of robustness, a row per case and point."""

from pathlib import Path
from typing import Any

import pandas as pd

from biogrip.errors import BiogripError
from biogrip.identify.methods import METHODS
from biogrip.stages.robustness import COLUMNS
from biogrip.tables.layout import Cell, Column, Table

_DETERMINED_PERCENT = 100.0


def robustness(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Put together the sweep over all its cases.

    Parameters
    ----------
    settings
        ``title``, ``cases`` (titles by name), ``methods``, and the axes ``rows`` and
        ``columns`` with ``label``, ``values`` (as shown, by what files have) and
        ``reconstructed``.
    inputs
        Judged points, CSV, a file per case and named like it.
    """
    rows: list[tuple[Cell, ...]] = []
    for name in settings["cases"]:
        points = read_points(inputs, name)
        for quantity in headlines(points):
            chosen = points[points["quantity"] == quantity]
            for (row, column), group in chosen.groupby(["row", "column"], sort=False):
                by_method = group.set_index("method")
                rows.append(
                    (
                        name,
                        settings["rows"]["values"][row],
                        settings["columns"]["values"][column],
                        quantity,
                        *(float(by_method["success_share"][m]) for m in settings["methods"]),
                        *(
                            float(by_method["median_absolute_error_percent"][m])
                            for m in settings["methods"]
                        ),
                        float(by_method["bound_percent"].iloc[0]),
                    )
                )
    titles = {method: METHODS[method].title for method in settings["methods"]}
    columns = (
        Column("case", "Case"),
        Column("row", _capital(axis_title(settings["rows"]))),
        Column("column", _capital(axis_title(settings["columns"]))),
        Column("quantity", "Quantity"),
        *(Column(f"success_{m}", f"Share at noise floor, {t}", 2) for m, t in titles.items()),
        *(Column(f"error_{m}", f"Median abs. error %, {t}", 2) for m, t in titles.items()),
        Column("bound_percent", "Bound %", 2),
    )
    caption = (
        f"{settings['title']}: of every case the best and the worst determined quantity. Bound is "
        "the standard deviation that noise leaves at least, to first order; the median absolute "
        "error of an estimator that attains it is 0.67 of that. Without noise, where there is no "
        "floor, the misfit of the truth rounded to two digits takes its place. The gripper's "
        "values are reconstructed."
    )
    return Table(caption, columns, rows)


def read_points(paths: list[Path], case: str) -> pd.DataFrame:
    """Read the judged points of a case, written by the robustness stage.

    Raises
    ------
    BiogripError
        If there are none among the files, or they are damaged.
    """
    for path in paths:
        if path.stem == case:
            try:
                points = pd.read_csv(path, dtype={"row": str, "column": str})
            except (OSError, ValueError) as error:
                raise BiogripError(f"{path}: cannot be read as a sweep: {error}.") from error
            if tuple(points.columns) != COLUMNS:
                raise BiogripError(f"{path}, line 1: wanted the columns {', '.join(COLUMNS)}.")
            return points
    raise BiogripError(f"{case}: no file of its points is given.")


def headlines(points: pd.DataFrame) -> list[str]:
    """Return the best and the worst determined quantity of a case.

    Only those count whose bound is below 100 % at half of the points or more. A sum
    stands for its parts: that they trade against each other, far from where they
    are, no bound of first order shows.
    """
    bounds = points.groupby("quantity")["bound_percent"].median().sort_values(kind="stable")
    parts = {part for label in bounds.index if " + " in label for part in label.split(" + ")}
    determined = [
        label
        for label, percent in bounds.items()
        if percent < _DETERMINED_PERCENT and label not in parts
    ]
    return determined[:1] + determined[1:][-1:]


def axis_title(axis: dict[str, Any]) -> str:
    """Name of an axis in print, marked where the paper does not give its values."""
    return f"{axis['label']}, reconstructed" if axis["reconstructed"] else axis["label"]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
