"""Numbers of the study in prose: taken from the published tables, never typed.

A number stands between two comments, of which the first says where it comes from:

    <!--= methods[case=liquid_drop_1, method=genetic].responses | .3g -->5400<!--/-->

It names a published table or a section of the benchmarks, rows by their columns (``|`` between
alternatives), a column and a format of Python's; ``%`` formats shares. Of several rows the lowest
and the highest are shown, or, with ``| each``, all that differ in the order of the table. ``count``
in the place of a column is the number of rows. In a row of a Markdown table, where ``|`` would end
the cell even in a comment, ``\\|`` stands for it.
"""

import json
import re

import pandas as pd

from tests.helpers.places import ROOT

PUBLISHED = ROOT / "results" / "published"
BENCHMARKS = ROOT / "benchmarks" / "results" / "benchmarks.json"

_NUMBER = re.compile(
    r"(<!--= *(?P<table>[\w/]+)(\[(?P<rows>[^\]]*)\])?\.(?P<column>[\w.]+)"
    r" *\\?\| *(?P<how>[^ |\\]+?) *(\\?\| *(?P<each>each) *)?-->)[^<]*(<!--/-->)"
)


def renewed_numbers(text: str) -> str:
    """Return a text with every marked number as the published tables have it."""
    renewed, count = _NUMBER.subn(lambda it: f"{it[1]}{_number(**it.groupdict())}<!--/-->", text)
    if count != text.count("<!--="):
        raise ValueError("A mark cannot be read: wanted <!--=TABLE[COLUMN=VALUE].COLUMN|FORMAT-->")
    return renewed


def _number(table: str, rows: str | None, column: str, how: str, each: str | None) -> str:
    found = _table(table)
    for condition in filter(None, re.split(r", *(?=\w+=)", rows or "")):
        name, _, values = condition.partition("=")
        found = found[found[name].isin(re.split(r"\\?\|", values))]
    if found.empty:
        raise ValueError(f"{table}[{rows}]: no such row")
    if column == "count":
        return format(len(found), how)
    numbers = pd.to_numeric(found[column]).dropna()
    shown = numbers if each else (numbers.min(), numbers.max())
    *before, last = dict.fromkeys(_formatted(number, how) for number in shown)
    if not before:
        return last
    joined = ", ".join(text.removesuffix(" %") for text in before)
    return f"{joined} {'and' if each else 'to'} {last}"


def _formatted(value: float, how: str) -> str:
    text = format(value, how)
    # Significant digits are wanted, not an exponent, of what is read as a number.
    if "e" in text and 1e-4 <= abs(value) < 1e6:
        return f"{float(text):,.0f}"
    return text.replace("%", " %")


def _table(table: str) -> pd.DataFrame:
    # Of tables that overlays have as well, that of the default study is meant, or OVERLAY/TABLE.
    overlay, _, table = table.rpartition("/")
    default = PUBLISHED / overlay / "tables" / f"{table}.csv"
    for file in (default, *sorted(PUBLISHED.rglob(f"{table}.csv"))):
        if file.is_file():
            return pd.read_csv(file, dtype=str, keep_default_na=False, na_values=[""])
    return pd.DataFrame(json.loads(BENCHMARKS.read_text("utf-8"))[table]).astype(str)
