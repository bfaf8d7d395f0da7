"""Processor time of the methods on the machine that ran them."""

from pathlib import Path

import pandas as pd

from biogrip.records.identifications import TIMINGS
from biogrip.study.study import Study
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("median_cpu_s", "Median CPU time (s)", 2),
    Column("total_cpu_s", "Total CPU time (s)", 3),
)


def timings(study: Study, times: list[Path]) -> Table:
    """Summarise processor time per identification by case and method, from CSV."""
    spent = pd.concat([TIMINGS.read(path) for path in times])
    rows: list[tuple[Cell, ...]] = [
        (
            case,
            study.identifiers[method].title,
            len(mine),
            float(mine["cpu_s"].median()),
            float(mine["cpu_s"].sum()),
        )
        for (case, method), mine in spent.groupby(["case", "method"], sort=False)
    ]
    return Table("Processor time of the identifications on this machine.", _COLUMNS, rows)


# Not in tables/, since times are not reproducible.
