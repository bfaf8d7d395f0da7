"""Pydantic models and a JSON Schema, derived from the dataclasses that define config keys."""

import re
from collections.abc import Mapping
from functools import cache, partial, reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    TypeAdapter,
    ValidationError,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from biogrip.study.typed import Shape, keys, spread

FORM, TWICE = "form", "twice"
"""Names of custom pydantic errors: text that does not match its pattern, and a repeated item."""


def errors_in(shape: Shape, value: Any) -> list[ErrorDetails]:
    """Validate a plain value with pydantic.

    Parameters
    ----------
    shape
        Schema of the value.
    value
        Plain value from a config file.

    Returns
    -------
    list
        Pydantic's errors; empty if the value is valid.
    """
    try:
        _adapter(shape).validate_python(value)
    except ValidationError as error:
        return error.errors(include_url=False)
    return []


def json_schema(block: type) -> dict[str, Any]:
    """Return the JSON Schema of a config dataclass."""
    return _model(block).model_json_schema()


def word(shape: Shape) -> str:
    """Return the kind of value a schema allows, in words."""
    if shape.options:
        return " or ".join(word(option) for option in shape.options)
    if shape.scalar:
        words = {int: "an integer", str: "text", bool: "true or false"}
        return words.get(shape.scalar, "a number")
    return "a list" if shape.items else "a block of keys"


def kind_of(value: Any) -> str | None:
    """Return the kind of a plain value in words, to choose among alternatives."""
    if isinstance(value, Mapping):
        return "a block of keys"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, str):
        return "text"
    return "a number" if isinstance(value, int | float) and not isinstance(value, bool) else None


@cache
def _adapter(shape: Shape) -> TypeAdapter[Any]:
    return TypeAdapter(_annotation(shape), config=None if shape.block else _CONFIG)


_CONFIG = ConfigDict(strict=True, extra="forbid", protected_namespaces=())


@cache
def _model(block: type) -> type[BaseModel]:
    """Return the pydantic model of a config dataclass."""
    named = keys(block)
    space: dict[str, Any] = {
        "__module__": block.__module__,
        "__doc__": block.__doc__,
        "__annotations__": {name: _annotation(entry.shape) for name, entry in named.items()},
        "model_config": _CONFIG,
    }
    # Optional keys default to None, which pydantic does not check.
    space |= {name: None for name, entry in named.items() if not entry.needed}
    rest = spread(block)
    if rest and rest.shape.values:
        space["__annotations__"]["__pydantic_extra__"] = dict[str, _annotation(rest.shape.values)]  # type: ignore[misc]
        space["model_config"] = {**_CONFIG, "extra": "allow"}
    return type(block.__name__, (BaseModel,), space)


def _annotation(shape: Shape) -> Any:
    """Return a type annotated with all constraints that pydantic checks."""
    key = shape.key
    limits: dict[str, Any] = {"ge": key.low, "gt": key.above, "le": key.high}
    limits |= {"min_length": key.fewest, "max_length": key.most}
    extra: dict[str, Any] = {"unit": key.unit} if key.unit else {}
    if key.unique:
        extra["uniqueItems"] = True
    if key.pattern:
        # \w of a JSON Schema matches ASCII letters only.
        extra["pattern"] = f"^{key.pattern}$".replace(r"\w", r"\w\u00aa-\uffff")
    said: list[Any] = [
        Field(
            description=key.text or None,
            json_schema_extra=extra or None,
            **{name: limit for name, limit in limits.items() if limit is not None},
        )
    ]
    if key.pattern:
        said.append(AfterValidator(partial(_formed, re.compile(key.pattern))))
    if key.unique:
        said.append(AfterValidator(_without_twins))
    return Annotated[(_bare(shape), *said)]


def _bare(shape: Shape) -> Any:
    if shape.options:
        tagged = [Annotated[_annotation(option), Tag(word(option))] for option in shape.options]
        return Annotated[reduce(or_, tagged), Discriminator(kind_of)]
    if shape.block:
        return _model(shape.block)
    if shape.items:
        return list[_annotation(shape.items)]  # type: ignore[misc]
    if shape.names and shape.values:
        return dict[_annotation(shape.names), _annotation(shape.values)]  # type: ignore[misc]
    if shape.key.choices:
        return Literal[shape.key.choices]
    return Any if shape.scalar is object else shape.scalar


def _formed(pattern: re.Pattern[str], text: str) -> str:
    if not pattern.fullmatch(text):
        raise PydanticCustomError(FORM, "not of the form that is allowed")
    return text


def _without_twins(items: list[Any]) -> list[Any]:
    if any(item in items[:index] for index, item in enumerate(items)):
        raise PydanticCustomError(TWICE, "something is there twice")
    return items
