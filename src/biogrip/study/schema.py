"""JSON Schema of config blocks as pydantic derives it, and a way to the part about a key."""

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from biogrip.keys import kind_of
from biogrip.study.plain import adapter

_UNITS = {
    **{name: name for name in ("s", "m", "Hz", "rad", "deg", "V")},
    "percent": "%",
    **{"Nm": "N m", "Nms": "N m s", "kgm2": "kg m²"},
    **{"Nms_per_rad": "N m s/rad", "Nm_per_rad": "N m/rad"},
}
_UNIT = re.compile(rf".*?_({'|'.join(_UNITS)})")
_WORDS = {"integer": "an integer", "boolean": "true or false", "string": "text", "array": "a list"}
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")
# Beyond 2^53 a float does not hold every integer.
_MOST_COUNTED = 2**53


class Schema:
    """Values that a config key may have: a part of a JSON Schema, with what it refers to."""

    def __init__(self, node: Mapping[str, Any], defs: Mapping[str, Any]) -> None:
        said = dict(node)
        while "$ref" in said:
            said = defs[said.pop("$ref").rpartition("/")[2]] | said
        self.node, self._defs = said, defs

    def get(self, keyword: str, default: Any = None) -> Any:
        """Return what a keyword of JSON Schema says."""
        return self.node.get(keyword, default)

    def within(self, node: Any) -> "Schema":
        """Return a part of this schema, or one that allows everything."""
        return Schema(node if isinstance(node, Mapping) else {}, self._defs)

    @property
    def keys(self) -> "dict[str, Schema]":
        """Named keys of a block."""
        return {name: self.within(node) for name, node in self.get("properties", {}).items()}

    @property
    def values(self) -> "Schema":
        """Values of keys that have no names of their own."""
        named = self.get("patternProperties") or {"": self.get("additionalProperties")}
        return self.within(next(iter(named.values())))

    @property
    def options(self) -> "list[Schema]":
        """Alternatives."""
        return [self.within(node) for node in self.get("oneOf", self.get("anyOf", []))]

    def option(self, kind: str | None) -> "Schema":
        """Return the alternative of a kind of value, or the schema itself."""
        return next((option for option in self.options if option.word == kind), self)

    def inside(self, part: object) -> "Schema":
        """Return the schema of a key or of an item."""
        if isinstance(part, int):
            return self.within(self.get("items"))
        node = self.get("properties", {}).get(part)
        return self.values if node is None else self.within(node)

    @property
    def word(self) -> str:
        """Kind of value, in words."""
        if self.options:
            return " or ".join(option.word for option in self.options)
        block = "properties" in self.node or self.get("type") == "object"
        return "a block of keys" if block else _WORDS.get(self.get("type"), "a number")

    def with_numbers(self, value: Any) -> Any:
        """Return a copy of a plain value, with text that is a number converted where one is wanted.

        YAML 1.1 takes ``1e-3`` for text, and Snakemake all that is in a block of its ``--config``,
        ``true`` and ``false``, too. Where text alone is allowed, it stays text.
        """
        here = self.option(kind_of(value))
        if isinstance(value, Mapping):
            return {name: here.inside(name).with_numbers(it) for name, it in value.items()}
        if isinstance(value, list | tuple):
            return [here.inside(0).with_numbers(item) for item in value]
        kinds = {option.get("type", "number") for option in (here, *self.options)}
        if isinstance(value, str) and "boolean" in kinds:
            return {"true": True, "false": False}.get(value.lower(), value)
        return _number(value) if isinstance(value, str) and kinds & {"number", "integer"} else value


@cache
def schema_of(kind: Any) -> Schema:
    """Return the schema of a config block."""
    found = tidy(adapter(kind).json_schema())
    return Schema(found["items"], found["$defs"])


def tidy(node: Any, name: str = "") -> Any:
    """Return a JSON Schema without null as an alternative, and with a unit where a name has one."""
    if isinstance(node, list):
        return [tidy(item) for item in node if item != {"type": "null"}]
    if name == "description" and isinstance(node, str):
        return node.partition("\n\n")[0].replace("\n", " ")
    if not isinstance(node, Mapping):
        return node
    said = {key: tidy(inner, key) for key, inner in node.items()}
    if name == "properties":
        return {key: _unit(key) | inner for key, inner in said.items()}
    if len(said.get("anyOf", ())) == 1:
        said |= said.pop("anyOf")[0] | said
    return said


def _unit(name: str) -> dict[str, str]:
    found = _UNIT.fullmatch(name)
    return {"unit": _UNITS[found[1]]} if found else {}


def _number(text: str) -> float | str:
    if not _NUMBER.fullmatch(text.strip()):
        return text
    number = float(text)
    return int(number) if number.is_integer() and abs(number) < _MOST_COUNTED else number
