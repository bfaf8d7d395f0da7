"""Messages about config values, from pydantic's errors: what was found, and what is allowed."""

from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from biogrip.digits import counted
from biogrip.errors import nearest
from biogrip.instrument.gripper import ROTATION
from biogrip.keys import CONFLICT, TWICE, Problem, kind_of
from biogrip.study.plain import built
from biogrip.study.schema import Schema, schema_of
from biogrip.traces.units import TIME_UNITS, nearest_unit

T = TypeVar("T")
MISSING = "is missing and has no default."

_UNITS = ([*TIME_UNITS], [*ROTATION.units])
_BOUNDS = {"exclusiveMinimum": "greater than", "minimum": "at least", "maximum": "at most"}
_MOST, _LONGEST = 1000, 40


def checked(kind: Callable[..., T], block: Any) -> tuple[T | None, list[Problem]]:
    """Build a config block from plain keys and values, or find what is not allowed in it."""
    try:
        return built(kind, block, check=True), []
    except ValidationError as error:
        errors = error.errors(include_url=False)
    errors.sort(key=lambda error: [str(part) for part in error["loc"]])
    return None, [_explained(schema_of(kind), it) for it in errors[:_MOST] if not _follows(it)]


def bound(limit: float) -> str:
    """Return a bound as text, whole numbers in full."""
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _explained(schema: Schema, error: ErrorDetails) -> Problem:
    """Follow the path of an error, which names alternatives and keys, too, to what is allowed."""
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
    of_name = error["loc"][-1] == "[key]"
    text = _text(path, leaf, above, error, of_name=of_name)
    # An unknown key of a mapping is reported for the block that contains it.
    return path[:-1] if of_name and error["type"] == "literal_error" else path, text


def _follows(error: ErrorDetails) -> bool:
    """Return True if a list is called too short because its items are not valid."""
    return error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"]


def _text(
    path: Sequence[Hashable], leaf: Schema, above: Schema, error: ErrorDetails, *, of_name: bool
) -> str:
    found = error["input"]
    match error["type"]:
        case "extra_forbidden" | "unexpected_keyword_argument":
            names = [*above.keys]
            return f"unknown key.{nearest(path[-1], names)} Allowed here: {', '.join(names)}."
        case "missing":
            return MISSING
        case "literal_error":
            choices = leaf.get("enum")
            hint = (nearest_unit if choices in _UNITS else nearest)(found, choices)
            return f"found {_shown(found)}.{hint} Allowed: {', '.join(choices)}."
        case "string_pattern_mismatch" if of_name:
            kind = str(path[-2]).removesuffix("s")
            return f"not a usable {kind} name: {leaf.get('form')} (it names files)."
        case "string_pattern_mismatch":
            return f"found {_shown(found)}, allowed is {leaf.get('form')}."
        case _ if error["type"] == TWICE:
            return "holds something twice; allowed is every item once."
        case _ if error["type"] == CONFLICT:
            return error["msg"]
        case "too_short" | "too_long" | "string_too_short" | "string_too_long":
            few = "min_length" in error["ctx"]
            words, limit = ("at least", "min_length") if few else ("at most", "max_length")
            what = "character" if isinstance(found, str) else "item"
            given = f"{_shown(found)} of {counted(len(found), what)}"
            return f"found {given}, allowed are {words} {error['ctx'][limit]}."
        case "finite_number":
            return f"found {_shown(found)}, allowed is a finite number."
        case "greater_than" | "greater_than_equal" | "less_than_equal":
            limits = [f"{_BOUNDS[it]} {bound(leaf.node[it])}" for it in _BOUNDS if it in leaf.node]
            text = f"{' and '.join(limits)} {leaf.get('unit', '')}".rstrip()
            return f"found {_shown(found)}, allowed is {text}."
    return f"found {_shown(found)}, allowed is {leaf.word}."


def _shown(value: Any) -> str:
    kind = "nothing" if value is None else kind_of(value)
    if kind in ("nothing", "a block of keys", "a list"):
        return kind
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
