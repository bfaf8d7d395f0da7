"""Messages about config values, from pydantic's errors: what was found, and what is allowed."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from biogrip.digits import counted
from biogrip.errors import nearest
from biogrip.instrument.gripper import ROTATION
from biogrip.keys import CONFLICT, TWICE, Problem
from biogrip.study.plain import built
from biogrip.study.schema import Schema, schema_of
from biogrip.traces.units import TIME_UNITS, nearest_unit

T = TypeVar("T")
MOST_EXPLAINED = 1000
MISSING = "is missing and has no default."

# Keys of earlier versions of the config, by their last two names.
_RETIRED: dict[tuple[Hashable, ...], str] = {
    ("models", "inertia"): "no longer needed: targets have the arms' inertia, fits do not. "
    "Leave it out.",
    ("readings",): "now called `interpretations`.",
    ("noise", "relaxing"): "now called `ar1`.",
}

_UNITS = ([*TIME_UNITS], [*ROTATION.units])
_BOUNDS = {"exclusiveMinimum": "greater than", "minimum": "at least", "maximum": "at most"}
_LONGEST = 40


def checked(kind: Callable[..., T], block: Any) -> tuple[T | None, list[Problem]]:
    """Build a config block from plain keys and values, or find what is not allowed in it.

    Returns
    -------
    block
        The block; None if it cannot be built.
    problems
        Path of a key in the block, and a message: what was found and what is allowed.
    """
    empty = [(path, _nothing(schema_of(kind), path)) for path in _empty((), block)]
    found: list[Problem] = [(path, text) for path, text in empty if text]
    errors: list[ErrorDetails] = []
    try:
        value = built(kind, block, check=not found)
    except ValidationError as error:
        value, errors = None, error.errors(include_url=False)
    errors.sort(key=lambda error: [str(part) for part in error["loc"]])
    explained = (_explained(schema_of(kind), error) for error in islice(errors, MOST_EXPLAINED))
    return value, [*found, *(problem for problem in explained if problem[1])]


def _empty(path: tuple[Hashable, ...], value: Any) -> Iterator[tuple[Hashable, ...]]:
    """Find keys without a value."""
    if value is None:
        yield path
    for key, inner in inside(value):
        yield from _empty((*path, key), inner)


def _nothing(schema: Schema, path: tuple[Hashable, ...]) -> str | None:
    for part in path:
        schema = schema.option("a block of keys").inside(part)
    return f"found nothing, allowed is {schema.word}." if schema.node else None


def unknown(path: Sequence[Hashable], allowed: list[str]) -> str:
    """Return the message about a key that a block does not have, or no longer has."""
    name, above = path[-1], tuple(path[-2:])
    if above in _RETIRED:
        return f"unknown key, {_RETIRED[above]}"
    return f"unknown key.{nearest(name, allowed)} Allowed here: {', '.join(allowed)}."


def inside(value: Any) -> Iterable[tuple[Any, Any]]:
    """Return what is in a block or a list, by key or index."""
    if isinstance(value, Mapping):
        return value.items()
    return enumerate(value) if isinstance(value, list) else ()


def bound(limit: float) -> str:
    """Return a bound as text, whole numbers in full."""
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _explained(schema: Schema, error: ErrorDetails) -> Problem:
    path: tuple[int | str, ...] = ()
    above = leaf = schema
    for part in error["loc"][1:]:
        chosen = leaf.option(str(part))
        if part == "[key]":
            leaf = above.within(above.get("propertyNames"))
        elif chosen is not leaf:
            leaf = chosen
        else:
            path, above, leaf = (*path, part), leaf, leaf.inside(part)
    if error["type"] == "literal_error" and error["loc"][-1] == "[key]":
        # An unknown key of a mapping is reported for the block that contains it.
        path = path[:-1]
    return path, _text(path, leaf, above, error)


def _text(path: tuple[int | str, ...], leaf: Schema, above: Schema, error: ErrorDetails) -> str:
    found = error["input"]
    match error["type"]:
        case "extra_forbidden" | "unexpected_keyword_argument":
            return unknown(path, [*above.keys])
        case "missing":
            return MISSING
        case "literal_error":
            choices = leaf.get("enum")
            hint = (nearest_unit if choices in _UNITS else nearest)(found, choices)
            return f"found {_shown(found)}.{hint} Allowed: {', '.join(choices)}."
        case "string_pattern_mismatch" if error["loc"][-1] == "[key]":
            kind = str(path[-2]).removesuffix("s")
            return f"not a usable {kind} name: {leaf.get('form')} (it names files)."
        case "string_pattern_mismatch":
            return f"found {_shown(found)}, allowed is {leaf.get('form')}."
        case _ if error["type"] == TWICE:
            return "holds something twice; allowed is every item once."
        case _ if error["type"] == CONFLICT:
            return error["msg"]
        case "too_short" | "too_long" | "string_too_short" | "string_too_long":
            return _length(found, error["ctx"], leaf.get("maxItems"))
        case "greater_than" | "greater_than_equal" | "less_than_equal":
            return f"found {_shown(found)}, allowed is {_range(leaf)}."
    return f"found {_shown(found)}, allowed is {leaf.word}."


def _length(found: Any, limits: Mapping[str, Any], most: int | None) -> str:
    few = "min_length" in limits
    if few and len(found) >= limits["min_length"]:
        # Items that are not valid do not count.
        return "" if most is None or len(found) <= most else _length(found, {"max_length": most}, 0)
    words, limit = ("at least", limits["min_length"]) if few else ("at most", limits["max_length"])
    if isinstance(found, str):
        count = counted(len(found), "character")
        return f"found {_shown(found)} of {count}, allowed are {words} {limit}."
    if isinstance(found, Mapping):
        if not found:
            return "is empty; at least one is needed."
        return f"found {counted(len(found), 'key')}, allowed are {words} {limit}."
    return f"found a list of {len(found)}, allowed are {words} {counted(limit, 'item')}."


def _range(leaf: Schema) -> str:
    limits = [
        f"{words} {bound(leaf.get(name))}"
        for name, words in _BOUNDS.items()
        if leaf.get(name) is not None
    ]
    return " and ".join(limits) + (f" {leaf.get('unit')}" if leaf.get("unit") else "")


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Mapping):
        return "a block of keys"
    if isinstance(value, list):
        return "a list"
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
