"""What was recognised in the file of a recording, for people to check before they believe a fit."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from biogrip.digits import counted
from biogrip.terminal import visible
from biogrip.traces.columns import Columns
from biogrip.traces.encoding import UTF_8

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True)
class Recognised:
    """Form of a file, as far as it was recognised."""

    encoding: str
    """Name of the encoding."""
    separator: str
    """Cell separator."""
    decimal_comma: bool
    """True if numbers have a decimal comma."""
    header_line: int
    """Line of the names."""
    units_line: int | None
    """Line of the row of units, if there is one."""
    block: int | None
    """Number of the block, from 1; None if the file has only one."""
    blocks: int
    """Number of blocks."""
    title: str
    """Some words of the block's preamble."""
    columns: dict[str, tuple[str, str]]
    """Name and unit of each column by its quantity."""
    rows: int = 0
    """Number of rows."""
    gaps: int = 0
    """Number of rows that were left out as gaps."""
    averaged: int = 0
    """Number of readings that were averaged, for they have equal times."""
    outside: int = 0
    """Number of readings that were left out, for they are not among the times to use."""
    range_s: tuple[float, float] = (0.0, 0.0)
    """First and last time."""

    def is_usual(self, columns: Columns) -> bool:
        """Return True if the file is a table as biogrip itself would write it."""
        return (
            (self.encoding, self.separator, self.decimal_comma) == (UTF_8, ",", False)
            and self.units_line is self.block is columns.block is None
            and not (columns.skip or self.title or self.averaged or self.outside)
            and (columns.time, columns.reading) == ("time_s", columns.quantity.column)
        )

    def stated(self, columns: Columns) -> Columns:
        """Return columns with the units that the file has."""
        (_, time_unit), (_, unit), *_ = self.columns.values()
        return replace(columns, time_unit=time_unit, reading_unit=unit)

    def data(self) -> dict[str, Any]:
        """Return the form as plain data, without what there is not."""
        found = {
            "encoding": self.encoding,
            "separator": _SEPARATORS[self.separator],
            "decimal": "comma" if self.decimal_comma else "point",
            "header_line": self.header_line,
            "units_line": self.units_line,
            "block": self.block,
            "blocks": self.blocks if self.block else None,
            "preamble": self.title or None,
            "columns": {
                quantity: {"column": name, "unit": unit}
                for quantity, (name, unit) in self.columns.items()
            },
            "rows": self.rows,
            "gaps": self.gaps,
            "averaged": self.averaged or None,
            "first_s": self.range_s[0],
            "last_s": self.range_s[1],
        }
        return {key: value for key, value in found.items() if value is not None}

    def in_words(self, path: Path) -> str:
        """Return the form as a small table."""
        units = f", units in line {self.units_line}" if self.units_line else ""
        rows = [
            (
                "text",
                f"{self.encoding}, cells between {_SEPARATORS[self.separator]}, decimal "
                f"{'comma' if self.decimal_comma else 'point'}",
            ),
            ("header", f"line {self.header_line}{units}"),
            ("preamble", self.title),
            ("block", f"{self.block} of {self.blocks}" if self.block else ""),
            *((quantity, f"{name}, in {unit}") for quantity, (name, unit) in self.columns.items()),
            ("rows", self._rows()),
        ]
        shown = [(name, visible(text)) for name, text in rows if text]
        width = max(len(name) for name, _ in shown)
        table = "".join(f"\n  {name:<{width}}  {text}" for name, text in shown)
        return f"{visible(path)} is read as{table}"

    def _rows(self) -> str:
        gaps = f", {counted(self.gaps, 'gap')}" if self.gaps else ""
        averaged = f", {counted(self.averaged, 'reading')} averaged" if self.averaged else ""
        outside = f", {self.outside} not among the times to use" if self.outside else ""
        first, last = self.range_s
        return f"{self.rows}{gaps}{averaged}{outside}, from {first:g} to {last:g} s"
