"""From config files to checked blocks, or to messages that name file, line and key.

A config is laid over the defaults of every trace. Blocks that several cases share are merged into
each before it is checked. Pydantic derives the schema of a block (`schema_of`), and finds what is
wrong in its values (`checked`). The place of each error is followed in the schema to the part about
the key, which says what is allowed there.
"""

import re
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from functools import cache, reduce
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from biogrip.config.source import (
    KeyPath,
    Source,
    dotted,
    overlaid,
    place,
    read_config,
    read_source,
    values_in,
)
from biogrip.config.trace_blocks import IntervalBlock
from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest, nearest_three
from biogrip.fit.problem import GeneRange, SearchRange
from biogrip.keys import OWN, Complaint, adapter, built, kind_of

T = TypeVar("T")

_BOUNDS = {"exclusiveMinimum": "greater than", "minimum": "at least", "maximum": "at most"}
# Most errors that are explained, and most characters of a value that are shown.
_MOST, _LONGEST = 1000, 40

_WORDS = {"integer": "an integer", "boolean": "true or false", "string": "text", "array": "a list"}
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")
_SWITCHES = {"true": True, "false": False}
# Beyond 2^53 a float does not hold every integer.
_MOST_COUNTED = 2**53


def checked(kind: Callable[..., T], block: Any) -> tuple[T | None, list[Complaint]]:
    """Build a config block from plain keys and values, or find what is not allowed in it."""
    try:
        return built(kind, block, check=True), []
    except ValidationError as error:
        errors = error.errors(include_url=False)
    errors.sort(key=lambda error: [str(part) for part in error["loc"]])
    # A list is also called too short because its items are not valid.
    explained = [
        error
        for error in errors[:_MOST]
        if error["type"] != "too_short" or len(error["input"]) < error["ctx"]["min_length"]
    ]
    return None, [_explained(schema_of(kind), error) for error in explained]


def bound(limit: float) -> str:
    """Return a bound as text, whole numbers in full."""
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _explained(schema: "Schema", error: ErrorDetails) -> Complaint:
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
    # An unknown key of a mapping is reported for the block that contains it.
    of_block = error["loc"][-1] == "[key]" and error["type"] == "literal_error"
    return path[:-1] if of_block else path, _text(path, leaf, above, error)


def _text(path: Sequence[Hashable], leaf: "Schema", above: "Schema", error: ErrorDetails) -> str:
    """Say what was found, and what is allowed; `above` is the schema of the block with the key."""
    found = error["input"]
    match error["type"]:
        case "extra_forbidden" | "unexpected_keyword_argument":
            names = [*above.keys]
            return f"unknown key.{nearest(path[-1], names)} Allowed here: {', '.join(names)}."
        case "missing":
            return "is missing and has no default."
        case "literal_error":
            choices = leaf.get("enum")
            if usual := leaf.get("usual"):
                near = nearest_three(found, [*choices, *usual])
                return f"found {_shown(found)}. Did you mean {near}? All: biogrip identify -h."
            return f"found {_shown(found)}.{nearest(found, choices)} Allowed: {', '.join(choices)}."
        case "string_pattern_mismatch":
            return f"found {_shown(found)}, allowed is {leaf.get('form')}."
        case _ if error["type"] == OWN:
            return error["msg"]
        case "too_short" | "too_long" | "string_too_short" | "string_too_long":
            few = error["ctx"].get("min_length")
            limit = f"at least {few}" if few else f"at most {error['ctx']['max_length']}"
            given = counted(len(found), "character" if isinstance(found, str) else "item")
            return f"found {_shown(found)} of {given}, allowed are {limit}."
        case "greater_than" | "greater_than_equal" | "less_than_equal":
            limits = [f"{_BOUNDS[it]} {bound(leaf.node[it])}" for it in _BOUNDS if it in leaf.node]
            return f"found {_shown(found)}, allowed is {' and '.join(limits)}."
    comma = isinstance(found, str) and _NUMBER.fullmatch(found.strip().replace(",", ".", 1))
    return f"found {_shown(found)}{' (a decimal comma?)' * bool(comma)}, allowed is {leaf.word}."


def _shown(value: Any) -> str:
    kind = kind_of(value)
    if value is None or kind in ("a block of keys", "a list"):
        return kind or "nothing"
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


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

    def converted(self, value: Any) -> Any:
        """Return a copy of a plain value, see `with_numbers`."""
        here = self.option(kind_of(value))
        if isinstance(value, Mapping):
            return {name: here.inside(name).converted(it) for name, it in value.items()}
        if isinstance(value, list | tuple):
            return [here.inside(0).converted(item) for item in value]
        kinds = {option.get("type", "number") for option in (here, *self.options)}
        if isinstance(value, str) and "boolean" in kinds:
            return _SWITCHES.get(value.lower(), value)
        wanted = isinstance(value, str) and kinds & {"number", "integer"}
        if not wanted or not _NUMBER.fullmatch(value.strip()):
            return value
        number = float(value)
        return int(number) if number.is_integer() and abs(number) < _MOST_COUNTED else number


def with_numbers(kind: Any, value: Any) -> Any:
    """Return a config block with text that is a number converted where one is wanted.

    YAML 1.1 takes ``1e-3`` for text, and Snakemake all that is in a block of its ``--config``,
    ``true`` and ``false``, too. Where text alone is allowed, it stays text.
    """
    texts = [it.strip() for _, it in values_in(value) if isinstance(it, str)]
    if any(_NUMBER.fullmatch(text) or text.lower() in _SWITCHES for text in texts):
        # Only then, for a schema takes longer to derive than all else of a config.
        return schema_of(kind).converted(value)
    return value


@cache
def schema_of(kind: Any) -> Schema:
    """Return the schema of a config block."""
    found = tidy(adapter(kind).json_schema())
    return Schema(found["items"], found["$defs"])


def tidy(node: Any) -> Any:
    """Return a JSON Schema without null as an alternative."""
    if isinstance(node, list):
        return [tidy(item) for item in node if item != {"type": "null"}]
    if not isinstance(node, Mapping):
        return node
    said = {key: tidy(inner) for key, inner in node.items()}
    if len(said.get("anyOf", ())) == 1:
        said |= said.pop("anyOf")[0] | said
    return said


# Most complaints in a message.
_SHOWN = 6
# Likeness from which a name is a key with a mistake, and not another key.
_MISSPELT = 0.8


def trace_defaults() -> Path:
    """Return the config file of what every trace takes unless it is told otherwise."""
    return Path(__file__).with_name("defaults.yaml")


def default_ranges() -> dict[str, GeneRange]:
    """Return the search ranges that every trace takes."""
    return dict(vars(built(SearchRange, read_config(trace_defaults())["search_range"])))


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and merge them, the later over the earlier, see `read_config`."""
    return reduce(overlaid, map(read_config, files), {})


def load(
    kind: Callable[..., T],
    config: Mapping[str, Any],
    sources: Sequence[Source],
    shared: Collection[str] = (),
) -> T:
    """Check and type a merged config, whose keys came from some sources.

    `shared` are blocks that are merged into each of its ``cases``. A `BiogripError` names file,
    line and key of the first few complaints, with what was found and what is allowed.
    """
    typed, complaints = checked(kind, _fill_in(with_numbers(kind, config), shared))
    refuse(complaints, sources, shared)
    assert typed is not None
    return typed


def refuse(
    complaints: Iterable[Complaint], sources: Sequence[Source], shared: Collection[str] = ()
) -> None:
    """Raise a `BiogripError` of complaints, if there are any."""
    messages: dict[str, None] = {}
    for path, text in complaints:
        # A complaint in a block that cases inherit is reported once, not once per case.
        origin = _origin(path, sources, shared)
        messages[f"{place(origin, sources)}: {dotted(origin)}: {text}"] = None
    if messages:
        shown = [*messages][:_SHOWN]
        more = [f"... and {len(messages) - _SHOWN} more."] if len(messages) > _SHOWN else []
        raise BiogripError("\n".join([*shown, *more]))


def read_config_of(kind: Any, files: Sequence[Path]) -> tuple[dict[str, Any], list[str]]:
    """Read config files, and return the keys that a kind of block has, and a note on each other.

    These may be of a study; one that is nearly a key of the block stays, to be refused.
    """
    config, sources, notes = read_configs(files), [*map(read_source, files)], list[str]()
    kinds: dict[tuple[str, ...], Any] = {(): kind, ("identifiability",): IntervalBlock}
    for above, block_kind in kinds.items():
        block: Any = config.get(above[0]) if above else config
        known = [field.name for field in fields(block_kind)]
        for name in [*block] if isinstance(block, dict) else ():
            if not get_close_matches(name, known, n=1, cutoff=_MISSPELT):
                path = (*above, name)
                notes.append(f"{place(path, sources)}: {dotted(path)}: is not used here.")
                del block[name]
    return config, notes


def _origin(path: KeyPath, sources: Sequence[Source], shared: Collection[str]) -> KeyPath:
    """Return the path of the shared key that a case inherits, or the path itself."""
    if len(path) < 3 or path[0] != "cases" or path[2] not in shared:
        return path
    for length in range(len(path), 2, -1):
        if any(path[:length] in lines for _, lines in sources):
            return path
        if any(path[2:length] in lines for _, lines in sources):
            break
    return path[2:]


def _fill_in(config: Mapping[str, Any], shared: Collection[str]) -> Mapping[str, Any]:
    """Merge shared blocks into every case; drop cases set to nothing."""
    if not shared or not isinstance(cases := config.get("cases"), dict):
        return config
    blocks = {name: config[name] for name in shared if name in config}
    filled = {name: overlaid(blocks, case) for name, case in cases.items() if case is not None}
    return {**config, "cases": filled}
