"""The error tables of all cases in one."""

from pathlib import Path
from typing import Any

import pandas as pd

from biogrip.errors import BiogripError
from biogrip.tables.errors import TABLE_COLUMNS
from biogrip.tables.layout import Cell, Table

_WHOLE_NUMBERS = {"best_seed", "seeds"}


def all_errors(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Join the error tables of the cases.

    Parameters
    ----------
    settings
        Nothing is needed.
    inputs
        Error tables, CSV.
    """
    rows: list[tuple[Cell, ...]] = []
    for path in inputs:
        try:
            frame = pd.read_csv(path, dtype=str, keep_default_na=False)
        except (OSError, ValueError) as error:
            raise BiogripError(f"{path}: cannot be read as a table: {error}.") from error
        rows += [
            tuple(_cell(name, text) for name, text in row.items())
            for row in frame.to_dict("records")
        ]
    caption = (
        "Identification errors of all cases. Best is the seed of lowest misfit. "
        "Error = (target - identified) / target."
    )
    return Table(caption, TABLE_COLUMNS, rows)


def _cell(name: object, text: str) -> Cell:
    if name in _WHOLE_NUMBERS:
        return int(text)
    try:
        return float(text)
    except ValueError:
        return text or None
