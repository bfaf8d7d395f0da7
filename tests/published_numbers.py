"""Numbers of the study in prose: taken from the published tables, never typed.

A number stands between two comments, of which the first says where it comes from, as
`biogrip.products.report.marks` has it:

    <!--= methods[case=liquid_drop_1, method=genetic].responses | .3g -->5400<!--/-->

It names a published table, or a section of the benchmarks. In a row of a Markdown table, where
``|`` would end the cell even in a comment, ``\\|`` stands for it.
"""

import json
import re
from functools import partial
from pathlib import Path

import pandas as pd

from biogrip.products.report.marks import number

ROOT = Path(__file__).parents[1]
PUBLISHED = ROOT / "results" / "published"
BENCHMARKS = ROOT / "benchmarks" / "results" / "benchmarks.json"

_NUMBER = re.compile(r"(<!--= *(?P<what>.*?) *-->)(?P<shown>.*?)(<!--/-->)", re.DOTALL)


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
    table = partial(_table, published=published)
    return _NUMBER.sub(
        lambda match: f"{match[1]}{number(_unescaped(match['what']), table)}{match[4]}", text
    )


def _unescaped(what: str) -> str:
    return what.replace(r"\|", "|")


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
