"""Sweeps: grids of cases that differ from a case of the study in two values.

A point of a grid is a case of its own. Its name is made of its values, so that the random streams,
which derive from it, stay the same when values are added.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any

from pydantic import BaseModel, Field, Tag

from biogrip.errors import nearest
from biogrip.keys import BY_KIND, OPEN, Block, Complaint, Distinct, Printed, plain
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock
from biogrip.study.source import overlaid

MOST_POINTS = 2000

_Number = Annotated[float, Field(ge=-1e12, le=1e12), Tag("a number")]
_Text = Annotated[str, Field(max_length=60), Tag("text")]


class ValueBlock(BaseModel):
    """Keys to merge into the block that the axis' key names."""

    model_config = OPEN
    __pydantic_extra__: dict[str, Annotated[_Number | _Text, BY_KIND]] = Field(init=False)

    label: Annotated[Printed, Field(description="Name of the value in print.")]

    @property
    def changes(self) -> dict[str, float | str]:
        """Values by their keys."""
        return self.__pydantic_extra__


@dataclass(frozen=True)
class Value:
    """A value on an axis of a sweep's grid."""

    name: str
    """Text for case names."""
    shown: str
    """Text for the axis and its table; numbers in the axis' unit."""
    overrides: dict[str, float | str]
    """Values that replace those of the case, by dotted key."""


@dataclass(frozen=True)
class AxisBlock(Block):
    """One axis of a sweep's grid: a key, or several, and its values."""

    label: Printed
    """Name in print."""
    key: Annotated[
        Annotated[str, Tag("text")]
        | Annotated[
            tuple[str, ...], Field(min_length=1, max_length=100), Distinct(), Tag("a list")
        ],
        BY_KIND,
    ]
    """Dotted key, or list of keys that change together, in any block that a case may change, e.g.
    `measurement.noise.level`."""
    values: Annotated[
        tuple[
            Annotated[_Number | _Text | Annotated[ValueBlock, Tag("a block of keys")], BY_KIND], ...
        ],
        Field(min_length=1, max_length=16),
        Distinct(),
    ]
    """Values of the key; or blocks to merge into the block of the key, each with a `label` of its
    own."""
    unit: Printed | None = None
    """Unit in print."""
    unit_in_si: Annotated[float, Field(ge=1e-24, le=1e24)] = 1.0
    """Size of this unit in the unit of the key, by default 1."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys that change together."""
        return (self.key,) if isinstance(self.key, str) else self.key

    @property
    def title(self) -> str:
        """Label with the unit."""
        return self.label if self.unit is None else f"{self.label} ({self.unit})"

    @property
    def levels(self) -> tuple[Value, ...]:
        """Values with their texts, in the order of the config."""
        return tuple(map(self._level, self.values))

    def _level(self, value: float | str | ValueBlock) -> Value:
        if isinstance(value, ValueBlock):
            inner = dict(sorted(value.changes.items()))
            overrides = {f"{key}.{name}": inner[name] for key in self.keys for name in inner}
            return Value("-".join(map(_word, inner.values())), value.label, overrides)
        shown = value if isinstance(value, str) else f"{value / self.unit_in_si:.4g}"
        return Value(_word(value), shown, dict.fromkeys(self.keys, value))

    def complaints(self) -> Iterator[Complaint]:
        """Refuse values of one name, and keys that no case may change."""
        for key in self.keys:
            if key.partition(".")[0] not in OVERRIDABLE:
                text = f"found '{key}', allowed is a key in a block that a case may change."
                yield ("key",), text + nearest(key, OVERRIDABLE)
        shown = [value.shown for value in self.levels]
        for index, value in enumerate(shown):
            if value in shown[:index]:
                yield ("values", index), f"is called '{value}' like one before it."


@dataclass(frozen=True)
class Point:
    """A point of a sweep's grid, i.e. a case with two values changed."""

    name: str
    """Name of the point's case."""
    case: str
    """Case that the point's case is derived from."""
    row: Value
    """Value on the axis of the rows."""
    column: Value
    """Value on the axis of the columns."""


@dataclass(frozen=True)
class SweepBlock(Block):
    """A grid of cases that differ from given cases in two values."""

    cases: Annotated[tuple[str, ...], Field(min_length=1, max_length=16), Distinct()]
    """Cases of the study that the grid is laid over."""
    rows: AxisBlock
    columns: AxisBlock
    title: Printed | None = None
    """Name in print; by default the sweep's name."""

    def points(self, name: str, case: str) -> list[Point]:
        """Return the points of one case, row by row, of the sweep of a name."""
        return [
            Point(f"{case}--{name}--{row.name}--{column.name}", case, row, column)
            for row, column in product(self.rows.levels, self.columns.levels)
        ]

    def complaints(self) -> Iterator[Complaint]:
        """Refuse keys that both axes set."""
        ours = {key for value in self.rows.levels for key in value.overrides}
        for index, changing in enumerate(self.columns.levels):
            for key in sorted(ours & changing.overrides.keys()):
                yield ("columns", "values", index), f"sets {key}, which the rows do too."

    def placed(self, point: Point, complaint: Complaint) -> Complaint:
        """Return a complaint of a point's case as one of the value that causes it."""
        path, text = complaint
        key = ".".join(map(str, path))
        for axis, value in (("rows", point.row), ("columns", point.column)):
            if any(f"{key}.".startswith(f"{changed}.") for changed in value.overrides):
                index = getattr(self, axis).levels.index(value)
                return (axis, "values", index), f"gives {key}: {text}"
        return (), f"{point.name}: gives {key}: {text}"


def list_points(sweeps: Mapping[str, SweepBlock]) -> Iterator[tuple[str, Point]]:
    """Yield every point of all sweeps with its sweep's name."""
    for name, sweep in sweeps.items():
        for case in sweep.cases:
            for point in sweep.points(name, case):
                yield name, point


def point_blocks(
    sweeps: Mapping[str, SweepBlock], cases: Mapping[str, CaseBlock]
) -> dict[str, dict[str, Any]]:
    """Return the config block of every point's case by name, as plain data, for checked sweeps."""
    found = {}
    blocks = {name: plain(case) for name, case in cases.items()} if sweeps else {}
    for _, point in list_points(sweeps):
        found[point.name] = blocks[point.case]
        for key, value in (point.row.overrides | point.column.overrides).items():
            # A key that counts takes no 8.0.
            changed: Any = int(value) if isinstance(value, float) and value.is_integer() else value
            for name in reversed(key.split(".")):
                changed = {name: changed}
            found[point.name] = overlaid(found[point.name], changed)
    return found


def name_complaints(sweeps: Mapping[str, SweepBlock], cases: Iterable[str]) -> Iterator[Complaint]:
    """Find points that have the names of cases or of other points."""
    found = {*cases}
    for sweep, point in list_points(sweeps):
        if point.name in found:
            text = f"has the point {point.name}, a name that there is already; allowed is another."
            yield (sweep,), text
        found.add(point.name)


def _word(value: float | str) -> str:
    """Return a value as text that is safe in file names."""
    text = value if isinstance(value, str) else f"{value:.15g}"
    return re.sub(r"[^A-Za-z0-9-]+", "_", text)
