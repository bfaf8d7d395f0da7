"""Error messages about plain config values: what was found, and what is allowed."""

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

from biogrip.digits import counted
from biogrip.errors import nearest
from biogrip.keys import Key, Problem
from biogrip.study.models import FORM, TWICE, errors_in, word
from biogrip.study.typed import Shape, keys, spread
from biogrip.traces.recordings import ROTATION_UNITS, TIME_UNITS, nearest_unit

MOST_EXPLAINED = 1000

# Keys of earlier versions of the config, by their last two names.
_RETIRED: dict[tuple[int | str, ...], str] = {
    ("models", "inertia"): "no longer needed: traces that show the arms ringing are fitted with "
    "their inertia. Leave it out.",
}

_UNITS = (tuple(TIME_UNITS), tuple(ROTATION_UNITS))
_LONGEST = 40
_KEY = "[key]"


def value_problems(shape: Shape, value: Any) -> Iterator[Problem]:
    """Yield an error message for every part of a value that is not allowed.

    Parameters
    ----------
    shape
        Schema of the value.
    value
        Plain value from a config file.

    Yields
    ------
    tuple
        Path of a key in the value, and a message: what was found and what is allowed.
    """
    # A NaN passes every comparison with a bound, so refuse it first.
    odd = list(_not_finite((), value))
    if odd:
        yield from odd
        return
    errors = sorted(errors_in(shape, value), key=lambda error: [str(p) for p in error["loc"]])
    for error in islice(errors, MOST_EXPLAINED):
        path, leaf, above = _found_at(shape, error["loc"])
        yield _explained(path, leaf, above, error["type"], error["input"])


def shape_at(shape: Shape, path: Sequence[str]) -> Shape:
    """Return the schema of a key's value, blocks by name."""
    for name in path:
        assert shape.block is not None
        shape = keys(shape.block)[name].shape
    return shape


def bound(limit: float) -> str:
    """Return a bound as text, whole numbers in full."""
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _found_at(
    shape: Shape, loc: tuple[int | str, ...]
) -> tuple[tuple[int | str, ...], Shape, Shape]:
    """Return where pydantic found an error: path, schema there, and schema of the block around."""
    path: list[int | str] = []
    above = shape
    for part in loc:
        if part == _KEY and above.names:
            return tuple(path), above.names, above
        chosen = [option for option in shape.options if word(option) == part]
        if chosen:
            (shape,) = chosen
            continue
        path.append(part)
        above, shape = shape, _inside(shape, part)
    return tuple(path), shape, above


def _inside(shape: Shape, part: int | str) -> Shape:
    if shape.block:
        entry, rest = keys(shape.block).get(str(part)), spread(shape.block)
        inner = entry.shape if entry else rest.shape.values if rest else None
    else:
        inner = shape.items or shape.values
    return inner or Shape(Key(), scalar=object)


def _explained(
    path: tuple[int | str, ...], leaf: Shape, above: Shape, error: str, found: Any
) -> Problem:
    key = leaf.key
    match error:
        case "extra_forbidden" if path[-2:] in _RETIRED:
            return path, f"unknown key, {_RETIRED[path[-2:]]}"
        case "extra_forbidden" if above.block:
            allowed = list(keys(above.block))
            hint = nearest(path[-1], allowed)
            return path, f"unknown key.{hint} Allowed here: {', '.join(allowed)}."
        case "missing":
            return path, "is missing and has no default."
        case "literal_error":
            # An unknown key of a mapping is reported for the block that contains it.
            place = path[:-1] if above.names is leaf else path
            known = nearest_unit if key.choices in _UNITS else nearest
            hint = known(found, key.choices)
            return place, f"found {_shown(found)}.{hint} Allowed: {', '.join(key.choices)}."
        case _ if error == FORM and above.names is leaf:
            kind = str(path[-2]).removesuffix("s")
            return path, f"not a usable {kind} name: {key.form} (it names files)."
        case _ if error == FORM:
            return path, f"found {_shown(found)}, allowed is {key.form}."
        case _ if error == TWICE:
            return path, "holds something twice; allowed is every item once."
        case "too_short" | "too_long" | "string_too_short" | "string_too_long":
            return path, _length(key, found)
        case "greater_than" | "greater_than_equal" | "less_than_equal":
            return path, f"found {_shown(found)}, allowed is {_range(key)}."
    return path, f"found {_shown(found)}, allowed is {word(leaf)}."


def _length(key: Key, found: Any) -> str:
    few = key.fewest is not None and len(found) < key.fewest
    words, limit = ("at least", key.fewest) if few else ("at most", key.most)
    if isinstance(found, str):
        return (
            f"found {_shown(found)} of {counted(len(found), 'character')}, allowed are "
            f"{words} {limit}."
        )
    if isinstance(found, Mapping):
        if not found:
            return "is empty; at least one is needed."
        return f"found {counted(len(found), 'key')}, allowed are {words} {limit}."
    return f"found a list of {len(found)}, allowed are {words} {counted(limit, 'item')}."


def _range(key: Key) -> str:
    bounds = {"greater than": key.above, "at least": key.low, "at most": key.high}
    limits = [f"{words} {bound(limit)}" for words, limit in bounds.items() if limit is not None]
    return " and ".join(limits) + (f" {key.unit}" if key.unit else "")


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Mapping):
        return "a block of keys"
    if isinstance(value, list):
        return "a list"
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _not_finite(path: tuple[Hashable, ...], value: Any) -> Iterator[Problem]:
    if isinstance(value, float):
        if not math.isfinite(value):
            yield path, f"found {value}, allowed is a finite number."
        return
    if isinstance(value, Mapping):
        inside: Iterable[tuple[Hashable, Any]] = value.items()
    else:
        inside = enumerate(value) if isinstance(value, list) else ()
    for key, inner in inside:
        if not isinstance(inner, str | int):
            yield from _not_finite((*path, key), inner)
