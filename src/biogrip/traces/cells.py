"""Cells of rows: separators, numbers and gaps."""

import csv

import numpy as np

SEPARATORS = (",", ";", "\t")
GAPS = ("", "-", "na", "n/a", "nan", "#n/a", "#nv")


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line without padding.

    Raises
    ------
    csv.Error
        If a cell is too long.
    """
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def cells_or_none(line: str, separator: str) -> list[str]:
    """Return the cells of a line; none of one that cannot be read as a row."""
    try:
        return split(line, separator)
    except csv.Error:
        return []


def count_numbers(cells: list[str]) -> int:
    """Count cells that are numbers, with a decimal point or comma."""
    return sum(map(is_number, cells))


def is_number(cell: str) -> bool:
    """Return True if a cell is a finite number, with a decimal point or comma."""
    return bool(np.isfinite(number_or_inf(cell.replace(",", "."))))


def number_or_inf(text: str) -> float:
    """Return a cell's number, NaN for a gap, and inf for anything else."""
    word = text.strip().lower()
    if word in GAPS:
        return np.nan
    try:
        return np.inf if "_" in word else float(word)
    except ValueError:
        return np.inf
