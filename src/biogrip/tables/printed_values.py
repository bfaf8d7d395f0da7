"""The numbers printed in Tables 5 to 7, held against the paper's own encoding and formula."""

from pathlib import Path
from typing import Any

from biogrip.identify.genome import nearest_encodable
from biogrip.study import build
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("quantity", "Quantity"),
    Column("printed", "Printed", 4),
    Column("nearest_encodable", "Nearest encodable", 2),
    Column("distance_percent", "Distance %", 2),
    Column("within_range", "Within range"),
    Column("printed_error_percent", "Printed error %"),
    Column("recomputed_error_percent", "Recomputed error %", 3),
)


def printed_values(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Check what the paper prints.

    Parameters
    ----------
    settings
        ``cases`` with their parameters and published values, ``search_range``.
    inputs
        None.
    """
    ranges = build.gene_ranges(settings["search_range"])
    rows: list[tuple[Cell, ...]] = []
    for case, block in settings["cases"].items():
        published = block["published"]
        for name in build.sample_model(block).names:
            target = block["parameters"][name]
            identified = published["identified"].get(name)
            for quantity, value in (("target", target), ("identified", identified)):
                if value is None or value <= 0:
                    continue
                genes = ranges[name]
                nearest = nearest_encodable(value, genes)
                errors: tuple[Cell, Cell] = (None, None)
                if quantity == "identified" and target:
                    printed = published["error_percent"].get(name)
                    errors = (printed, 100 * (target - value) / target)
                distance = 100 * (value - nearest) / value
                within = "yes" if genes.low <= value <= genes.high else "no"
                rows.append(
                    (case, name, quantity, value, nearest, distance, within, *errors),
                )
    caption = (
        "Printed values of Tables 5 to 7 against the two-digit encoding of eq. (10), the ranges "
        "of Table 4, and the printed errors against (target - identified) / target."
    )
    return Table(caption, _COLUMNS, rows)
