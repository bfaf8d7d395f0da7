"""Sweeps: grids of cases, each a case of the study with two of its values changed."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from biogrip.keys import Key, printed
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.typed import plain

_LARGEST = 1e12
_LONGEST_TEXT = 60

_Number = Annotated[float, Key(low=-_LARGEST, high=_LARGEST)]
_Text = Annotated[str, Key(most=_LONGEST_TEXT)]


@dataclass(frozen=True)
class ValueBlock:
    """Keys that are laid over the block of the axis' key."""

    label: Annotated[str, printed("Name of the value in print.")]
    changes: Annotated[Mapping[str, _Number | _Text], Key(spread=True)]


@dataclass(frozen=True)
class AxisBlock:
    """What changes along one direction of a sweep's grid."""

    label: Annotated[str, printed("Name in print.")]
    key: Annotated[
        str | Annotated[tuple[str, ...], Key(fewest=1, most=100, unique=True)],
        Key(
            "Dotted key, or list of keys that change together, in any block that a case may "
            "change, e.g. `measurement.noise.level`."
        ),
    ]
    values: Annotated[
        tuple[_Number | _Text | ValueBlock, ...],
        Key(
            "Values of the key; or blocks that are laid over the block of the key, each with a "
            "`label` of its own.",
            fewest=1,
            most=16,
            unique=True,
        ),
    ]
    unit: Annotated[str | None, printed("Unit in print.")] = None
    unit_in_si: Annotated[
        float, Key("One such unit in that of the key, by default 1.", low=1e-24, high=1e24)
    ] = 1.0

    @property
    def keys(self) -> tuple[str, ...]:
        """What changes together."""
        return (self.key,) if isinstance(self.key, str) else self.key


@dataclass(frozen=True)
class SweepBlock:
    """Every point of the grid is a case like another, but for the two values."""

    cases: Annotated[
        tuple[str, ...],
        Key("Cases of the study that the grid is laid over.", fewest=1, most=16, unique=True),
    ]
    rows: Annotated[AxisBlock, Key()]
    columns: Annotated[AxisBlock, Key()]
    title: Annotated[
        str | None,
        printed("Name in print; by default the sweep's name."),
    ] = None


@dataclass(frozen=True)
class Value:
    """A value on an axis.

    Parameters
    ----------
    name, text, shown
        In the names of cases; in files, numbers as the config has them; on an
        axis, numbers in the axis' unit.
    overrides
        What a case has instead, by dotted key.
    """

    name: str
    text: str
    shown: str
    overrides: dict[str, float | str]


@dataclass(frozen=True)
class Axis:
    """One of the two directions of a grid.

    Parameters
    ----------
    label
        Name in print, with the unit.
    values
        In their order.
    """

    label: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Point:
    """A place in a grid.

    Parameters
    ----------
    name
        Name of its case. Made of the values, so that a value more on an axis
        renames no other point: random streams go by the name.
    case
        The case that it is derived from.
    row, column
        What is different.
    """

    name: str
    case: str
    row: Value
    column: Value

    @property
    def overrides(self) -> dict[str, float | str]:
        """What its case has instead, by dotted key."""
        return {**self.row.overrides, **self.column.overrides}


@dataclass(frozen=True)
class Sweep:
    """A grid of values, laid over each of some cases.

    Parameters
    ----------
    name, title
        In files; in print.
    cases
        Names of cases of the study.
    rows, columns
        What changes from row to row, and from column to column.
    """

    name: str
    title: str
    cases: tuple[str, ...]
    rows: Axis
    columns: Axis

    def points(self, case: str) -> list[Point]:
        """Points of one of the cases, row by row."""
        return [
            Point(f"{case}--{self.name}--{row.name}--{column.name}", case, row, column)
            for row in self.rows.values
            for column in self.columns.values
        ]


def sweeps_of(blocks: Mapping[str, SweepBlock]) -> dict[str, Sweep]:
    """Read the sweeps of a study."""
    return {
        name: Sweep(
            name, block.title or name, block.cases, axis_of(block.rows), axis_of(block.columns)
        )
        for name, block in blocks.items()
    }


def axis_of(block: AxisBlock) -> Axis:
    """Read an axis."""
    unit = f" ({block.unit})" if block.unit is not None else ""
    return Axis(block.label + unit, tuple(_values(block)))


def points_of(sweeps: Mapping[str, Sweep]) -> Iterator[tuple[Sweep, Point]]:
    """Points of all sweeps."""
    for sweep in sweeps.values():
        for case in sweep.cases:
            for point in sweep.points(case):
                yield sweep, point


def point_blocks(
    sweeps: Mapping[str, Sweep], cases: Mapping[str, CaseBlock]
) -> dict[str, dict[str, Any]]:
    """Make the block of every point's case, by name, as a file would have it.

    Parameters
    ----------
    sweeps
        Without `biogrip.study.sweep_checks.sweep_problems`.
    cases
        The study's.
    """
    found = {}
    blocks = {name: plain(case) for name, case in cases.items()} if sweeps else {}
    for _, point in points_of(sweeps):
        block = blocks[point.case]
        for key, value in point.overrides.items():
            block = _changed(block, key, value)
        found[point.name] = block
    return found


def _values(axis: AxisBlock) -> Iterator[Value]:
    for value in axis.values:
        if isinstance(value, ValueBlock):
            inner = {name: value.changes[name] for name in sorted(value.changes)}
            overrides = {f"{key}.{name}": inner[name] for key in axis.keys for name in inner}
            name = "-".join(map(_word, inner.values()))
            yield Value(name, value.label, value.label, overrides)
        else:
            shown = value if isinstance(value, str) else f"{value / axis.unit_in_si:.4g}"
            yield Value(_word(value), _text(value), shown, dict.fromkeys(axis.keys, value))


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.15g}"


def _word(value: float | str) -> str:
    """Return a value as letters that a file name may have."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", _text(value))


def _changed(block: dict[str, Any], key: str, value: float | str) -> dict[str, Any]:
    name, _, rest = key.partition(".")
    return {**block, name: _changed(block.get(name, {}), rest, value) if rest else value}
