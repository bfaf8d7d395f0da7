"""Results of a sweep: a row per case and point."""

from pathlib import Path

from biogrip.fit.success import near_noise_words
from biogrip.tables.heat_maps import (
    HeatMaps,
    headlines_of,
    read_points,
)
from biogrip.tables.layout import Cell, Column, Table

# Name and heading of columns that exist for every method.
_BY_METHOD = {
    "near_noise_share": ("near_noise", "Share {near_noise}"),
    "basin_share": ("basin", "Share in the true basin"),
    "basin_error_percent": ("basin_error", "Median abs. error there %"),
    "median_absolute_error_percent": ("error", "Median abs. error of all %"),
}


def robustness(maps: HeatMaps, points: Path) -> Table:
    """Join the points of a sweep over all its cases."""
    rows: list[tuple[Cell, ...]] = []
    for name in maps.cases:
        found = read_points(points, maps.name, name)
        for quantity in headlines_of(found):
            chosen = found[found["quantity"] == quantity]
            for (row, column), group in chosen.groupby(["row", "column"], sort=False):
                by_method = group.set_index("method")
                rows.append(
                    (
                        name,
                        maps.rows.values[row],
                        maps.columns.values[column],
                        quantity,
                        *(float(by_method[c][m]) for c in _BY_METHOD for m in maps.methods),
                        float(by_method["bound_percent"].iloc[0]),
                    )
                )
    words = near_noise_words(maps.near_noise_tolerance)
    titles = {name: method.title for name, method in maps.methods.items()}
    columns = (
        Column("case", "Case"),
        Column("row", _capital(maps.rows.title)),
        Column("column", _capital(maps.columns.title)),
        Column("quantity", "Quantity"),
        *(
            Column(f"{name}_{m}", f"{heading.format(near_noise=words)}, {t}", 2)
            for name, heading in _BY_METHOD.values()
            for m, t in titles.items()
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
