"""Conversion of text like ``1e-3`` to numbers, since YAML 1.1 takes it for text without a dot."""

import re
from collections.abc import Mapping
from typing import Any

from biogrip.study.typed import Shape, keys, spread
from biogrip.study.yaml_text import LONGEST_NUMBER

_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+")
_MOST_COUNTED = 2**53
_NUMERIC = (int, float, object)


def with_numbers(shape: Shape, value: Any) -> Any:
    """Return a copy of a plain value with text like ``1e-3`` converted where a number is allowed.

    Parameters
    ----------
    shape
        Schema of the value; parts that do not match it are kept as they are.
    value
        Plain value as YAML loads it.
    """
    shapes = (shape, *shape.options)
    if isinstance(value, Mapping):
        inside = next((s for s in shapes if s.block or s.values or s.scalar is object), None)
        return {name: _inner(inside, name, item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        items = next((s.items for s in shapes if s.items), None)
        return [with_numbers(items, item) if items else item for item in value]
    if isinstance(value, str) and any(s.scalar in _NUMERIC for s in shapes):
        return _number(value)
    return value


def _inner(shape: Shape | None, name: object, value: Any) -> Any:
    if shape is None:
        return value
    inner = shape.values or shape
    if shape.block:
        entry, rest = keys(shape.block).get(str(name)), spread(shape.block)
        found = entry.shape if entry else rest.shape.values if rest else None
        if found is None:
            return value
        inner = found
    return with_numbers(inner, value)


def _number(text: str) -> float | str:
    if len(text) > LONGEST_NUMBER or not _NUMBER.fullmatch(text.strip()):
        return text
    number = float(text)
    # Beyond 2^53 a float does not hold every integer.
    whole = number.is_integer() and abs(number) < _MOST_COUNTED
    return int(number) if whole else number
