"""Checks of sweeps against the cases of a study."""

from collections.abc import Iterator, Mapping

from biogrip.errors import nearest
from biogrip.keys import Problem
from biogrip.study.case_blocks import CaseBlock, Shared
from biogrip.study.schema import Schema, schema_of
from biogrip.study.sweeps import (
    MOST_POINTS,
    AxisBlock,
    Point,
    SweepBlock,
    ValueBlock,
    list_points,
)

_AXES = ("rows", "columns")
_LONGEST_NAME = 200


def sweep_problems(
    blocks: Mapping[str, SweepBlock], cases: Mapping[str, CaseBlock]
) -> Iterator[Problem]:
    """Find sweeps that conflict with the cases or have too many points."""
    problems = [
        (("sweeps", name, *path), text)
        for name, block in blocks.items()
        for path, text in _block_problems(block, cases)
    ]
    points = sum(
        len(block.cases) * len(block.rows.values) * len(block.columns.values)
        for block in blocks.values()
    )
    if not problems and points > MOST_POINTS:
        problems = [(("sweeps",), f"found {points} points, allowed are {MOST_POINTS} together.")]
    yield from problems
    if not problems:
        yield from _name_problems(blocks, cases)


def placed(
    sweeps: Mapping[str, SweepBlock], by_name: Mapping[str, tuple[str, Point]], problem: Problem
) -> Problem:
    """Return a problem of a point's case, ``cases`` and its name leading the path, as the sweep's.

    It is one of the value that causes it.
    """
    (_, name, *rest), text = problem
    key = ".".join(map(str, rest))
    sweep, point = by_name[str(name)]
    for axis, value in zip(_AXES, (point.row, point.column), strict=True):
        for changed in value.overrides:
            if key == changed or key.startswith(f"{changed}."):
                index = getattr(sweeps[sweep], axis).levels.index(value)
                return ("sweeps", sweep, axis, "values", index), f"gives {key}: {text}"
    shown = f"{point.row.text} and {point.column.text} for {point.case}"
    return ("sweeps", sweep), f"{shown}: gives {key}: {text}"


def _block_problems(block: SweepBlock, cases: Mapping[str, CaseBlock]) -> Iterator[Problem]:
    for index, case in enumerate(block.cases):
        if case not in cases:
            text = f"found '{case}', allowed is a case of the study.{nearest(case, cases)}"
            yield ("cases", index), text
            return
    axes = dict(zip(_AXES, (block.rows, block.columns), strict=True))
    for name, axis in axes.items():
        for path, text in _key_problems(axis):
            yield (name, *path), text
        shown = [value.text for value in axis.levels]
        for index, value in enumerate(shown):
            if value in shown[:index]:
                yield (name, "values", index), f"is called '{value}' like one before it."
    ours = {key for value in block.rows.levels for key in value.overrides}
    for index, changing in enumerate(block.columns.levels):
        for key in changing.overrides:
            if key in ours:
                yield ("columns", "values", index), f"sets {key}, which the rows do too."


def _key_problems(axis: AxisBlock) -> Iterator[Problem]:
    """Refuse keys that no case may change: blocks change blocks, single values change values."""
    kinds = {isinstance(value, ValueBlock) for value in axis.values}
    if len(kinds) > 1:
        yield ("values",), "holds blocks and single values; allowed is one kind of them."
        return
    (with_blocks,) = kinds
    allowed = [key for key, is_block in _dotted(schema_of(Shared)) if is_block == with_blocks]
    for key in axis.keys:
        if key not in allowed:
            expected = "a block" if with_blocks else "a single value"
            text = f"found '{key}', allowed is the key of {expected} that a case may change."
            yield ("key",), text + nearest(key, allowed)


def _dotted(block: Schema, path: str = "") -> Iterator[tuple[str, bool]]:
    """Yield dotted keys in a block and below, each with True if it is a block itself."""
    for name, inner in block.keys.items():
        if inner.keys:
            yield f"{path}{name}", True
            yield from _dotted(inner, f"{path}{name}.")
        elif inner.is_single:
            yield f"{path}{name}", False


def _name_problems(
    sweeps: Mapping[str, SweepBlock], cases: Mapping[str, CaseBlock]
) -> Iterator[Problem]:
    found_before: set[str] = set()
    for sweep, point in list_points(sweeps):
        if point.name in cases:
            text = f"is the name of a point of the sweep {sweep}; allowed is another name."
            yield ("cases", point.name), text
        if point.name in found_before:
            text = f"has the point {point.name} twice; allowed is every combination once."
            yield ("sweeps", sweep), text
        found_before.add(point.name)
        if len(point.name) > _LONGEST_NAME:
            text = f"has the point {point.name[:60]}..., a name of {len(point.name)} characters; "
            yield ("sweeps", sweep), f"{text}allowed are {_LONGEST_NAME} (it names files)."
            return
