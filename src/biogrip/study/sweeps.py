"""Sweeps: grids of cases, each a case of the study with two of its values changed."""

import copy
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from biogrip.errors import nearest
from biogrip.study.meaning import Problem
from biogrip.study.source import KeyPath

_AXES = ("rows", "columns")
_MOST_POINTS = 2000
_LONGEST_NAME = 200


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


def sweeps_of(config: Mapping[str, Any]) -> dict[str, Sweep]:
    """Read the sweeps of a config that fits the schema."""
    return {
        name: Sweep(
            name,
            block.get("title", name),
            tuple(block["cases"]),
            *(_axis(block[axis]) for axis in _AXES),
        )
        for name, block in config.get("sweeps", {}).items()
    }


def point_blocks(config: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Make the case block of every point of every sweep, by name.

    Parameters
    ----------
    config
        Complete and without `sweep_problems`.
    """
    return {
        point.name: _changed(config["cases"][point.case], point.overrides)
        for _, point in _all_points(config)
    }


def sweep_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Find what is wrong with the sweeps of a config that is else in order.

    Yields
    ------
    tuple
        The path of the key, and what was found and what is allowed.
    """
    problems = [
        problem
        for name, block in config.get("sweeps", {}).items()
        for problem in _block_problems(("sweeps", name), block, config)
    ]
    points = sum(
        len(sweep.cases) * len(sweep.rows.values) * len(sweep.columns.values)
        for sweep in sweeps_of(config).values()
    )
    if not problems and points > _MOST_POINTS:
        problems = [(("sweeps",), f"found {points} points, allowed are {_MOST_POINTS} together.")]
    yield from problems
    if not problems:
        yield from _name_problems(config)


def placed(config: Mapping[str, Any], problem: Problem) -> Problem:
    """Return a problem of a point's case as one of the value that makes it.

    Parameters
    ----------
    config
        Complete and without `sweep_problems`.
    problem
        Its path starts with ``cases`` and the name of a point.
    """
    (_, name, *rest), text = problem
    key = ".".join(map(str, rest))
    sweep, point = next(found for found in _all_points(config) if found[1].name == name)
    for axis, value in zip(_AXES, (point.row, point.column), strict=True):
        for changed in value.overrides:
            if key == changed or key.startswith(f"{changed}."):
                values = getattr(sweep, axis).values
                index = next(i for i, other in enumerate(values) if other.name == value.name)
                return ("sweeps", sweep.name, axis, "values", index), f"gives {key}: {text}"
    shown = f"{point.row.text} and {point.column.text} for {point.case}"
    return ("sweeps", sweep.name), f"{shown}: gives {key}: {text}"


def _axis(block: Mapping[str, Any]) -> Axis:
    unit = f" ({block['unit']})" if "unit" in block else ""
    keys = _keys(block)
    values = tuple(_value(value, keys, block.get("unit_in_si", 1.0)) for value in block["values"])
    return Axis(block["label"] + unit, values)


def _keys(axis: Mapping[str, Any]) -> list[str]:
    return [axis["key"]] if isinstance(axis["key"], str) else list(axis["key"])


def _value(value: Any, keys: list[str], unit_in_si: float) -> Value:
    if isinstance(value, Mapping):
        inner = {name: value[name] for name in sorted(value) if name != "label"}
        label = value["label"]
        overrides = {f"{key}.{name}": inner[name] for key in keys for name in inner}
        return Value("-".join(map(_word, inner.values())), label, label, overrides)
    shown = value if isinstance(value, str) else f"{value / unit_in_si:.4g}"
    return Value(_word(value), _text(value), shown, dict.fromkeys(keys, value))


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.15g}"


def _word(value: float | str) -> str:
    """Return a value as letters that a file name may have."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", _text(value))


def _all_points(config: Mapping[str, Any]) -> Iterator[tuple[Sweep, Point]]:
    for sweep in sweeps_of(config).values():
        for case in sweep.cases:
            for point in sweep.points(case):
                yield sweep, point


def _changed(case: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    changed = copy.deepcopy(dict(case))
    for key, value in overrides.items():
        *path, last = key.split(".")
        block = changed
        for part in path:
            block = block[part]
        block[last] = value
    return changed


def _block_problems(
    path: KeyPath, block: Mapping[str, Any], config: Mapping[str, Any]
) -> Iterator[Problem]:
    cases = config["cases"]
    for index, case in enumerate(block["cases"]):
        if case not in cases:
            text = f"found '{case}', allowed is a case of the study.{nearest(case, cases)}"
            yield (*path, "cases", index), text
            return
    for axis in _AXES:
        for case in block["cases"]:
            # What a case may change are the blocks that it has from the study.
            blocks = {key: inner for key, inner in cases[case].items() if key in config}
            yield from _key_problems((*path, axis), block[axis], blocks)
        shown = [value.text for value in _axis(block[axis]).values]
        for index, text in enumerate(shown):
            if text in shown[:index]:
                yield (*path, axis, "values", index), f"is called '{text}' like one before it."
    rows, columns = (_axis(block[axis]) for axis in _AXES)
    ours = {key for value in rows.values for key in value.overrides}
    for index, value in enumerate(columns.values):
        for key in value.overrides:
            if key in ours:
                yield (*path, "columns", "values", index), f"sets {key}, which the rows do too."


def _key_problems(
    path: KeyPath, axis: Mapping[str, Any], blocks: Mapping[str, Any]
) -> Iterator[Problem]:
    """Every key must lead somewhere: blocks are laid over blocks, single values over others."""
    with_blocks = all(isinstance(value, Mapping) for value in axis["values"])
    if not with_blocks and any(isinstance(value, Mapping) for value in axis["values"]):
        yield (*path, "values"), "holds blocks and single values; allowed is one kind of them."
        return
    allowed = [key for key, is_block in _dotted(blocks) if is_block == with_blocks]
    for key in _keys(axis):
        if key not in allowed:
            wanted = "a block" if with_blocks else "a single value"
            text = f"found '{key}', allowed is the key of {wanted} that a case may change."
            yield (*path, "key"), text + nearest(key, allowed)


def _dotted(block: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, bool]]:
    """Keys in a block and below, and whether each is a block itself."""
    for key, value in block.items():
        is_block = isinstance(value, Mapping)
        yield f"{path}{key}", is_block
        if is_block:
            yield from _dotted(value, f"{path}{key}.")


def _name_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    seen: set[str] = set()
    for sweep, point in _all_points(config):
        if point.name in config["cases"]:
            text = f"is the name of a point of the sweep {sweep.name}; allowed is another name."
            yield ("cases", point.name), text
        if point.name in seen:
            text = f"has the point {point.name} twice; allowed is every combination once."
            yield ("sweeps", sweep.name), text
        seen.add(point.name)
        if len(point.name) > _LONGEST_NAME:
            text = f"has the point {point.name[:60]}..., a name of {len(point.name)} characters; "
            yield ("sweeps", sweep.name), f"{text}allowed are {_LONGEST_NAME} (it names files)."
            return
