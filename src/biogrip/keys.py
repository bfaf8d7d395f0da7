"""Config blocks: frozen dataclasses whose fields are their keys, as pydantic checks them.

Bounds are pydantic's `Field`, and a docstring below each field says what the key means. Checks,
messages, the JSON Schema and the documentation follow from them. Added to pydantic are names from a
registry (`OneOf`), lists without twins (`Distinct`), and what is wrong with keys together
(`complaints` of a block).
`built` and `plain` convert between plain values, as in YAML and JSON, and blocks.
"""

import json
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    TypeAdapter,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, ValidationError
from pydantic_core.core_schema import literal_schema

from biogrip.errors import nearest

T = TypeVar("T")

# Most names that a complaint lists.
_NAMES_LISTED = 6

Complaint = tuple[tuple[Hashable, ...], str]
"""Path of a key, relative to its block, and a message: what was found and what is allowed."""

OWN = "complaint"
"""Type of our own pydantic errors, whose messages are complete."""


def formed(pattern: str, form: str) -> Any:
    """Return the annotation of text that a pattern describes, and its form in words."""
    return Field(pattern=pattern, json_schema_extra={"form": form})


Printed = Annotated[
    str,
    formed(
        r"^[\w.,:;()/%'][\w .,:;()+/%'-]{0,59}$",
        "text of 1 to 60 letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning with a "
        "space, + or -",
    ),
]
"""Text that is safe in tables, figures and file formats."""

STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
"""Configuration of blocks."""

OPEN = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, frozen=True, defer_build=True)
"""Configuration of models that collect the keys that they do not name."""


def below(path: tuple[Hashable, ...], complaints: Iterable[Complaint]) -> Iterator[Complaint]:
    """Yield complaints of a block as those of one that has it, at a path."""
    return (((*path, *inner), text) for inner, text in complaints)


def kind_of(value: Any) -> str | None:
    """Return the kind of a value in words, by which pydantic chooses among alternatives."""
    if isinstance(value, Mapping | BaseModel | Block):
        return "a block of keys"
    if isinstance(value, list | tuple):
        return "a list"
    if isinstance(value, str):
        return "text"
    return "a number" if isinstance(value, int | float) and not isinstance(value, bool) else None


BY_KIND = Discriminator(kind_of)
"""Annotation of alternatives, each with its kind as `Tag`."""


def unknown_names(
    path: tuple[str, ...], names: Iterable[str], allowed: Collection[str]
) -> Iterator[Complaint]:
    """Find names in a list that are not among those allowed, of which the first few are said."""
    for index, name in enumerate(names):
        if name not in allowed:
            text = f"found '{name}', allowed are {', '.join([*allowed][:_NAMES_LISTED])}."
            yield (*path, index), text + nearest(name, allowed)


class Checked:
    """Base class of models that find conflicts between their keys, where the context is true."""

    def complaints(self) -> Iterator[Complaint]:
        """Find keys that conflict."""
        return iter(())

    @model_validator(mode="after")
    def _refuse_conflicts(self, info: ValidationInfo) -> Self:
        conflicts: list[Any] = [
            {"type": PydanticCustomError(OWN, text), "loc": path, "input": None}
            for path, text in (self.complaints() if info.context else ())
        ]
        if conflicts:
            raise ValidationError.from_exception_data(OWN, conflicts)
        return self


class Block(Checked):
    """Base class of frozen dataclasses whose fields are the keys of a config block."""

    # A copy, which the documentation adds to.
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(**STRICT)


@dataclass(frozen=True, eq=False)
class OneOf:
    """Annotation of text that is one of the names in a registry, as `Literal` is of given ones."""

    names: Iterable[str]

    def __get_pydantic_core_schema__(self, _: Any, __: GetCoreSchemaHandler) -> CoreSchema:
        """Check with pydantic as a `Literal`."""
        return literal_schema(list(self.names))


def _without_twins(items: tuple[Any, ...]) -> tuple[Any, ...]:
    if any(item in items[:index] for index, item in enumerate(items)):
        raise PydanticCustomError(OWN, "holds something twice; allowed is every item once.")
    return items


Distinct = Annotated[
    T, AfterValidator(_without_twins), Field(json_schema_extra={"uniqueItems": True})
]
"""A list whose items must differ; its bounds stand within the brackets."""


@cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """Return what pydantic checks, builds and writes a list of blocks with."""
    # Pydantic takes a configuration for a list of dataclasses, and none for a dataclass alone.
    return TypeAdapter(list[kind], config=STRICT)


def built(kind: Callable[..., T], block: Any, *, check: bool = False) -> T:
    """Return the object that a plain block describes; if asked, find conflicts of keys, too."""
    # As JSON, for then pydantic takes blocks for dataclasses and lists for tuples. It refuses bytes
    # of names that are not valid text.
    text = json.dumps([block], default=str, ensure_ascii=False).encode("utf-8", "replace")
    return adapter(kind).validate_json(text, context=check)[0]


def plain(value: object) -> Any:
    """Return the plain value of a config block, without keys that have their default."""
    kind: Callable[..., object] = type(value)
    return adapter(kind).dump_python([value], mode="json", exclude_defaults=True)[0]
