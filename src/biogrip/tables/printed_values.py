"""Check of the values in Tables 5 to 7 against the paper's own encoding and error formula."""

import numpy as np

from biogrip.fit.genome import nearest_encodable
from biogrip.study.study import Study
from biogrip.tables.errors_of_case import error_percent
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


def printed_values(study: Study) -> Table:
    """Compare published values with encoding, range and error formula."""
    ranges = study.ranges
    rows: list[tuple[Cell, ...]] = []
    for case, reported in study.cases.items():
        truth = reported.truth
        printed = truth.published
        for name in truth.model.names:
            target = truth.parameters[name]
            identified = printed.identified.get(name)
            for quantity, value in (("target", target), ("identified", identified)):
                if value is None or value <= 0:
                    continue
                genes = ranges[name]
                nearest = nearest_encodable(value, genes)
                errors: tuple[Cell, Cell] = (None, None)
                if quantity == "identified" and target:
                    printed_percent = printed.error_percent.get(name)
                    errors = (printed_percent, float(error_percent(target, np.array([value]))[0]))
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
