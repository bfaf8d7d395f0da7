"""What the identifiers cost on the machine that ran them."""

from pathlib import Path
from typing import Any

import pandas as pd

from biogrip.errors import BiogripError
from biogrip.identify.methods import METHODS
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("median_cpu_s", "Median CPU time (s)", 2),
    Column("total_cpu_s", "Total CPU time (s)", 3),
)


def timings(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Processor time per identification, by case and method.

    Parameters
    ----------
    settings
        Nothing is needed.
    inputs
        Processor times of the cases, CSV.
    """
    try:
        spent = pd.concat([pd.read_csv(path) for path in inputs])
    except (OSError, ValueError) as error:
        raise BiogripError(f"{inputs[0]} and others: cannot be read as times: {error}.") from error
    rows: list[tuple[Cell, ...]] = [
        (
            case,
            METHODS[method].title,
            len(mine),
            float(mine["cpu_s"].median()),
            float(mine["cpu_s"].sum()),
        )
        for (case, method), mine in spent.groupby(["case", "method"], sort=False)
    ]
    return Table("Processor time of the identifications on this machine.", _COLUMNS, rows)
