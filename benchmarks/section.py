"""One benchmark's part of the report."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

Row = dict[str, Any]


@dataclass(frozen=True)
class Section:
    """A table of the report, and perhaps a figure.

    Parameters
    ----------
    name
        Its key in the JSON file; also names the figure's file.
    title, text
        Heading; what was done and how to read the rows.
    columns
        By heading, how a row's cell is printed.
    rows
        Plain numbers and words, as in the JSON file.
    figure
        Draws it.
    """

    name: str
    title: str
    text: str
    columns: Mapping[str, Callable[[Row], str]]
    rows: Sequence[Row]
    figure: Callable[[], Figure] | None = None

    def table(self) -> str:
        """Return the rows as a Markdown table."""
        cells = [{head: cell(row) for head, cell in self.columns.items()} for row in self.rows]
        return markdown(cells)


def written(section: Section) -> str:
    """Return a section as Markdown."""
    parts = [f"## {section.title}", section.text, section.table()]
    if section.figure is not None:
        parts.append(f"![{section.title}]({section.name}.png)")
    return "\n\n".join(parts)


def renewed(text: str, described: Mapping[str, str], sections: Sequence[Section]) -> str:
    """Return a report with some sections in the place of those of the same title, or at its end."""
    parts = text.rstrip("\n").split("\n\n## ")
    for section in sections:
        new = f"{written(section)}\n\nRun by itself:\n\n{markdown([described])}"
        new = new.removeprefix("## ")
        titles = [part.partition("\n")[0] for part in parts]
        if section.title in titles:
            parts[titles.index(section.title)] = new
        else:
            parts.append(new)
    return "\n\n## ".join(parts) + "\n"


def markdown(rows: Sequence[Mapping[str, str]]) -> str:
    """Return rows of text as a Markdown table."""
    return str(pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True))


def number(value: float, digits: int = 3) -> str:
    """Print a number with so many digits, and never in powers of ten between 0.001 and 10^6."""
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    decimals = max(0, digits - 1 - int(f"{value:e}".split("e")[1]))
    return f"{value:,.{decimals}f}"


def times_ours(row: Row) -> str:
    """Print a row's ratio with the range over the rounds."""
    low, high = (number(row[f"times_ours_{end}"], 2) for end in ("lowest", "highest"))
    return "1" if row["times_ours"] == 1 else f"{number(row['times_ours'])} ({low} to {high})"
