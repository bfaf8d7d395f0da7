"""Conversion between plain values, as in YAML and JSON, and config blocks."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

from pydantic import ConfigDict, TypeAdapter

T = TypeVar("T")
STRICT = ConfigDict(strict=True, extra="forbid")


@cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """Return what pydantic checks, builds and writes a list of blocks with."""
    # Pydantic takes a configuration for a list of dataclasses, and none for a dataclass alone.
    return TypeAdapter(list[kind], config=STRICT)


def built(kind: Callable[..., T], block: Any, *, check: bool = False) -> T:
    """Return the object that a plain block describes; if asked, find conflicts of keys, too."""
    # As JSON, for then pydantic takes blocks for dataclasses and lists for tuples.
    found: T
    (found,) = adapter(kind).validate_json(json.dumps([block], default=str), context=check)
    return found


def plain(value: object) -> Any:
    """Return the plain value of a config block, without keys that have their default."""
    kind: Callable[..., object] = type(value)
    return adapter(kind).dump_python([value], mode="json", exclude_defaults=True)[0]
