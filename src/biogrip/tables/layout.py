"""Tables as CSV for computing, and as Markdown, LaTeX and HTML for reading."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import pandas as pd

from biogrip.files import write_text
from biogrip.records.rows import write_rows

Cell = str | float | int | None


@dataclass(frozen=True)
class Column:
    """A column of a table: its names in CSV and print."""

    name: str
    """Name in the CSV."""
    heading: str
    """Heading in print."""
    digits: int = 3
    """Significant digits of numbers in print."""


@dataclass(frozen=True)
class Table:
    """A table with caption, columns and rows."""

    caption: str
    """Description of the table in a sentence or two."""
    columns: tuple[Column, ...]
    rows: Sequence[tuple[Cell, ...]]
    """None is an empty cell."""


def write(table: Table, output: Path) -> None:
    """Write a table as CSV with six significant digits, and as .md, .tex and .html.

    The latter omit empty columns.
    """
    shown = pd.DataFrame(
        [
            [_text(cell, column.digits) for cell, column in zip(row, table.columns, strict=True)]
            for row in table.rows
        ],
        columns=[column.heading for column in table.columns],
    )
    if len(shown):
        shown = shown.loc[:, (shown != "").any()]
    barless = shown.map(_without_bars).rename(columns=_without_bars)
    markdown = barless.to_markdown(index=False, disable_numparse=True)
    latex = shown.to_latex(
        index=False,
        escape=True,
        caption=table.caption.replace("%", r"\%").replace("_", r"\_"),
        label=f"tab:{output.stem}",
        column_format="l" * shown.shape[1],
    )
    names = [column.name for column in table.columns]
    write_rows(output, names, ([_text(cell, 6) for cell in row] for row in table.rows))
    write_text(output.with_suffix(".md"), f"{table.caption}\n\n{markdown}\n")
    write_text(output.with_suffix(".tex"), latex)
    write_text(output.with_suffix(".html"), _page(table.caption, shown))


def _text(cell: Cell, digits: int) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if isinstance(cell, float):
        # Round the CSV's number, so that print and CSV agree; adding zero turns -0 into 0.
        shown = float(f"{cell:.6g}")
        return f"{float(f'{shown:.{digits}g}') + 0.0:.{digits}g}"
    return str(cell)


def _without_bars(text: str) -> str:
    """Escape bars and line ends, which would end a cell or row of a Markdown table."""
    return text.replace("|", r"\|").replace("\n", " ")


def _page(caption: str, shown: pd.DataFrame) -> str:
    style = (
        "body{font-family:sans-serif;margin:1.5em}table{border-collapse:collapse}"
        "th,td{padding:.3em .7em;border-bottom:1px solid #ccc;text-align:left}"
        "th{border-bottom:2px solid #333}p{max-width:60em}"
    )
    body = shown.to_html(index=False, border=0)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><style>{style}</style>'
        f"</head><body>\n<p>{escape(caption)}</p>\n{body}\n</body></html>\n"
    )
