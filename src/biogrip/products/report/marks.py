"""Numbers of tables in prose: taken from the tables by a mark, never typed.

A mark names a table, rows by their columns (``=``, ``!=``, and ``|`` between alternatives), a
column and a format of Python's; ``%`` formats shares:

    methods[case=liquid_drop_1, method=genetic algorithm].median_evaluations | .0f

Of several rows the lowest and the highest are shown, or, with ``| each``, all that differ in the
order of the table. ``count`` in the place of a column is the number of rows.
"""

import re
from collections.abc import Callable

import pandas as pd

_WHAT = re.compile(
    r"(?P<table>\w+)(?:\[(?P<rows>[^\]]*)\])?\.(?P<column>\w+)"
    r" *\| *(?P<format>[^ |]+)(?: *\| *(?P<all>each))?"
)
_CONDITION = re.compile(r"(?P<column>\w+)(?P<sign>!?=)(?P<values>.*)")


class NoSuchRowError(ValueError):
    """A table has no row as a mark wants it."""


def number(what: str, table: Callable[[str], pd.DataFrame]) -> str:
    """Return what a mark stands for.

    Parameters
    ----------
    what
        The mark.
    table
        Function that returns a table by name, as text, with NaN for empty cells.

    Raises
    ------
    ValueError
        If a mark cannot be read, or names a column that there is not.
    NoSuchRowError
        If it names a row that there is not.
    """
    match = _WHAT.fullmatch(what)
    if match is None:
        raise ValueError(f"{what!r}: wanted TABLE[COLUMN=VALUE, ...].COLUMN | FORMAT")
    rows = _rows(table(match["table"]), match["rows"] or "")
    if not len(rows):
        raise NoSuchRowError(f"{what!r}: no such row")
    if match["column"] == "count":
        return format(len(rows), match["format"])
    if match["column"] not in rows:
        raise ValueError(f"{what!r}: allowed columns are {', '.join(rows)}")
    values = pd.to_numeric(rows[match["column"]]).dropna()
    if not match["all"]:
        values = pd.Series([values.min(), values.max()])
    shown = list(dict.fromkeys(_formatted(value, match["format"]) for value in values))
    *before, last = shown
    if not before:
        return last
    joined = ", ".join(text.removesuffix(" %") for text in before)
    return f"{joined}{' and' if match['all'] else ' to'} {last}"


def _rows(rows: pd.DataFrame, conditions: str) -> pd.DataFrame:
    for condition in filter(None, re.split(r", *(?=\w+!?=)", conditions)):
        match = _CONDITION.fullmatch(condition)
        if match is None or match["column"] not in rows:
            raise ValueError(f"{condition!r}: allowed columns are {', '.join(rows)}")
        there = rows[match["column"]].isin(match["values"].split("|"))
        rows = rows[there if match["sign"] == "=" else ~there]
    return rows


def _formatted(value: float, how: str) -> str:
    text = format(value, how)
    # Significant digits are wanted, not an exponent, of what is read as a number.
    if "e" in text and 1e-4 <= abs(value) < 1e6:
        return f"{float(text):,.0f}"
    return text.replace("%", " %")
