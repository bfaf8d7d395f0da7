"""What a sweep says of robustness, a row per case and point."""

from pathlib import Path

from biogrip.identify.methods import METHODS
from biogrip.products.heat_maps import (
    CAPTION,
    HeatMaps,
    headlines,
    heat_maps,
    points_of_cases,
    read_points,
)
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table


def robustness(maps: HeatMaps, points: list[Path]) -> Table:
    """Put together the sweep over all its cases.

    Parameters
    ----------
    maps
        The sweep.
    points
        Judged points, CSV, a file per case and named like it.
    """
    rows: list[tuple[Cell, ...]] = []
    for name in maps.cases:
        found = read_points(points, name)
        for quantity in headlines(found):
            chosen = found[found["quantity"] == quantity]
            for (row, column), group in chosen.groupby(["row", "column"], sort=False):
                by_method = group.set_index("method")
                rows.append(
                    (
                        name,
                        maps.rows.values[row],
                        maps.columns.values[column],
                        quantity,
                        *(float(by_method["success_share"][m]) for m in maps.methods),
                        *(
                            float(by_method["median_absolute_error_percent"][m])
                            for m in maps.methods
                        ),
                        float(by_method["bound_percent"].iloc[0]),
                    )
                )
    titles = {method: METHODS[method].title for method in maps.methods}
    columns = (
        Column("case", "Case"),
        Column("row", _capital(maps.rows.title)),
        Column("column", _capital(maps.columns.title)),
        Column("quantity", "Quantity"),
        *(Column(f"success_{m}", f"Share at noise floor, {t}", 2) for m, t in titles.items()),
        *(Column(f"error_{m}", f"Median abs. error %, {t}", 2) for m, t in titles.items()),
        Column("bound_percent", "Bound %", 2),
    )
    caption = (
        f"{maps.title}: of every case the best and the worst determined quantity. Bound is "
        "the standard deviation that noise leaves at least, to first order; the median absolute "
        "error of an estimator that attains it is 0.67 of that. Without noise, where there is no "
        "floor, the misfit of the truth rounded to two digits takes its place. The gripper's "
        "values are reconstructed."
    )
    return Table(caption, columns, rows)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


ROBUSTNESS = table(
    robustness,
    name="robustness",
    item="robustness: {sweep}",
    caption=CAPTION,
    settings=heat_maps,
    reads={"points": points_of_cases()},
    sweeps=True,
    sheet="",
)
