"""Tables: written as CSV for computing and as HTML for reading, and as Markdown.

CSV has six significant digits, print as many as a column says, of the number in the CSV.
"""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.files import write_rows, write_text

Row = dict[str, Any]
"""Text or numbers by the name of their column; None, NaN or no cell is an empty one."""

_STYLE = (
    "body{font-family:sans-serif;margin:1.5em}table{border-collapse:collapse}"
    "th,td{padding:.3em .7em;border-bottom:1px solid #ccc;text-align:left}"
    "th{border-bottom:2px solid #333}p{max-width:60em}"
)
_TAG = re.compile("<(?=[A-Za-z/!?])")


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    name: str
    """Name in the CSV, and in rows."""
    heading: str
    """Heading in print."""
    digits: int = 3
    """Significant digits of numbers in print."""


def titled(*names: str) -> tuple[Column, ...]:
    """Return columns whose headings are their names."""
    return tuple(Column(name, name.capitalize()) for name in names)


@dataclass(frozen=True)
class ShownTable:
    """A table with caption, columns and rows."""

    caption: str
    """Description of the table in a sentence or two."""
    columns: tuple[Column, ...]
    rows: Sequence[Mapping[str, Any]]
    """See `Row`."""


def write(table: ShownTable, output: Path) -> None:
    """Write a table as CSV, and without empty columns as HTML beside it.

    Parameters
    ----------
    table
        Caption, columns and rows.
    output
        The CSV; the HTML has the same name.
    """
    columns = table.columns
    shown = pd.DataFrame(
        [[_cell_text(row.get(c.name), c.digits) for c in columns] for row in table.rows],
        columns=[c.heading for c in columns],
    )
    if len(shown):
        shown = shown.loc[:, (shown != "").any()]
    html = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"/><style>{_STYLE}</style>'
        f"</head><body>\n<p>{escape(table.caption)}</p>\n{shown.to_html(index=False, border=0)}\n"
        "</body></html>\n"
    )
    cells = ([_cell_text(row.get(c.name), 6) for c in columns] for row in table.rows)
    write_rows(output, [c.name for c in columns], cells)
    write_text(output.with_suffix(".html"), html)


def markdown_of(page: Path) -> str:
    """Return a table's HTML, as `write` made it, as Markdown."""
    # Well-formed after its first line, but for what pandas makes of two blanks.
    text = page.read_text(encoding="utf-8").partition("\n")[2].replace("&nbsp;", " ")
    body = ElementTree.fromstring(text)[1]
    headings, *rows = ([_without_bars(cell.text or "") for cell in row] for row in body.iter("tr"))
    table = pd.DataFrame(rows, columns=headings).to_markdown(index=False, disable_numparse=True)
    return f"{_TAG.sub('&lt;', body.findtext('p', ''))}\n\n{table}\n"


def write_markdown(page: Path, markdown: Path) -> None:
    """Write a table's HTML as Markdown."""
    write_text(markdown, markdown_of(page))


def as_published(table: Path) -> tuple[str, str]:
    """Return name and text under which a table is published: CSV as it is, HTML as Markdown."""
    if table.suffix == ".html":
        return f"{table.stem}.md", markdown_of(table)
    return table.name, table.read_bytes().decode()


def _cell_text(cell: Any, digits: int) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float | np.floating):
        # Round the CSV's number, so that print and CSV agree; adding zero turns -0 into 0.
        shown = float(f"{cell:.6g}")
        return "" if np.isnan(cell) else f"{float(f'{shown:.{digits}g}') + 0.0:.{digits}g}"
    return str(cell)


def _without_bars(text: str) -> str:
    """Escape bars, line ends and tags, which a Markdown table would not show as text."""
    return _TAG.sub("&lt;", " ".join(text.splitlines())).replace("|", r"\|")
