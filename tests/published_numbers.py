"""Numbers of the study in prose: taken from the published tables, never typed.

A number stands between two comments, of which the first says where it comes from:

    <!--= methods[case=liquid_drop_1, method=genetic].responses | .3g -->5400<!--/-->

It names a published table or a section of the benchmarks, rows by their columns (``=``, ``!=``,
and ``|`` between alternatives), a column and a format of Python's; ``%`` formats shares. Of several
rows the lowest and the highest are shown, or, with ``| each``, all that differ in the order of the
table. ``count`` in the place of a column is the number of rows. In a row of a Markdown table, where
``|`` would end the cell even in a comment, ``\\|`` stands for it.
"""

import json
import re
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[1]
PUBLISHED = ROOT / "results" / "published"
BENCHMARKS = ROOT / "benchmarks" / "results" / "benchmarks.json"

_NUMBER = re.compile(r"(<!--= *(?P<what>.*?) *-->)(?P<shown>.*?)(<!--/-->)", re.DOTALL)
_WHAT = re.compile(
    r"(?P<table>\w+)(?:\[(?P<rows>[^\]]*)\])?\.(?P<column>[\w.]+)"
    r" *\| *(?P<format>[^ |]+)(?: *\| *(?P<all>each))?"
)
_CONDITION = re.compile(r"(?P<column>\w+)(?P<sign>!?=)(?P<values>.*)")


def renewed_numbers(text: str, published: Path = PUBLISHED) -> str:
    """Return a text with every marked number as the published tables have it.

    Parameters
    ----------
    text
        A document.
    published
        The folder of published tables.

    Raises
    ------
    ValueError
        If a mark cannot be read, or names a table, column or row that there is not.
    """
    return _NUMBER.sub(
        lambda match: f"{match[1]}{_number(match['what'], published)}{match[4]}", text
    )


def _number(what: str, published: Path) -> str:
    match = _WHAT.fullmatch(what.replace(r"\|", "|"))
    if match is None:
        raise ValueError(f"{what!r}: wanted TABLE[COLUMN=VALUE, ...].COLUMN | FORMAT")
    rows = _rows(_table(match["table"], published), match["rows"] or "")
    if not len(rows):
        raise ValueError(f"{what!r}: no such row")
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


def _table(table: str, published: Path) -> pd.DataFrame:
    # Of tables that overlays have as well, that of the default study is meant.
    default = published / "tables" / f"{table}.csv"
    files = [default] if default.is_file() else sorted(published.rglob(f"{table}.csv"))
    if files:
        return pd.read_csv(files[0], dtype=str, keep_default_na=False, na_values=[""])
    sections = json.loads(BENCHMARKS.read_text(encoding="utf-8"))
    if table not in sections:
        raise ValueError(f"{table}: no such table")
    return pd.DataFrame(sections[table]).astype(str)
