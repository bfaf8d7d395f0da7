"""How a dropped file looks before it is fitted: its blocks, first rows, and its columns as numbers.

Models are drawn beside their names.
"""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.sample_model import SampleModel
from biogrip.traces.tables import Sheet, Table, find_marks, is_clock, overview, seconds_or_inf

_ROWS_SHOWN, _MOST_POINTS, _MOST_VALUES = 6, 1000, 12
_SPRING, _DAMPER, _SPRINGPOT = "─/\\/\\─", "─[==]─", "──<>──"


@dataclass(frozen=True)
class Preview:
    """A file as it was read, and one of its tables."""

    sheet: Sheet
    tables: list[Table]
    table: Table
    """The one that is shown."""

    @property
    def rows(self) -> list[list[str]]:
        """Its first rows."""
        rows = slice(self.table.first, min(self.table.first + _ROWS_SHOWN, self.table.end))
        return [[*map(str, row)] for row in self.sheet.cells[rows, : len(self.table.names)]]

    @cached_property
    def conditions(self) -> list[str]:
        """Values of columns that have few, each of several rows, as `--rows` has them."""
        counts = {name: Counter(self._cells(name)) for name in self.table.names if name}
        few = (it for it in counts.items() if 1 < len(it[1]) <= _MOST_VALUES)
        some = ((name, values) for name, values in few if min(values.values()) > 2)
        return [f"{name}={value}" for name, values in some for value in values if value]

    def numbers(self, name: str) -> Array:
        """Return the numbers of a column, (n_rows,); NaN for what is none, times of day in s."""
        cells = self._cells(name)
        number = find_marks(cells, self.sheet.separator).number
        number = seconds_or_inf if is_clock(cells) else number
        values = np.array([*map(number, cells)], dtype=float)
        return np.where(np.isfinite(values), values, np.nan)

    @cached_property
    def points(self) -> dict[str, list[float | None]]:
        """Numbers of all columns that have any, of some rows, None for none."""
        every = -(-(self.table.end - self.table.first) // _MOST_POINTS) or 1
        columns = {name: self.numbers(name)[::every] for name in self.table.names if name}
        return {
            name: [None if value != value else value for value in values.tolist()]
            for name, values in columns.items()
            if np.any(np.isfinite(values))
        }

    def _cells(self, name: str) -> list[str]:
        rows = slice(self.table.first, self.table.end)
        return [*map(str, self.sheet.cells[rows, self.table.names.index(name)])]


@lru_cache(maxsize=8)
def previewed(path: Path, changed_ns: int, block: str = "") -> Preview:
    """Return a file's preview, of a block or its longest table; anew if its time of change is."""
    sheet, tables = overview(path)
    longest = max(tables, key=lambda table: table.end - table.first)
    number = int(block) if block.isdecimal() and 0 < int(block) <= len(tables) else 0
    return Preview(sheet, tables, tables[number - 1] if number else longest)


def network_of(model: SampleModel) -> list[list[str]]:
    """Return the drawing of a model: groups in series, of branches in parallel.

    What has an `s` in its name is in series with all, `v` is a Kelvin-Voigt element, `p` is
    parallel to the rest, of which springs and dampers of one number are a branch.
    """
    names = [own.name for own in model.parameters if own.name not in ("alpha", "beta")]
    drawn = {name: _DAMPER if name.startswith("c") else _SPRING for name in names}
    drawn |= dict.fromkeys({"k_alpha", "k_beta"} & {*drawn}, _SPRINGPOT)
    branches: dict[str, str] = {}
    for name in names:
        of = name if name[2:] in ("p", "s", "v") else name[2:].strip("alphbet")
        of += name * (model.name == "springpots_in_parallel")
        branches[of] = branches.get(of, "") + drawn[name]
    alone = [[branches.pop(name)] for name in ("k_s", "c_s") if name in branches]
    kelvin = [branches.pop(name) for name in ("k_v", "c_v") if name in branches]
    return [*alone, *filter(None, (kelvin, [*branches.values()]))]
