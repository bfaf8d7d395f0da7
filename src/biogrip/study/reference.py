"""The description of every config key, as Markdown, from the schema and the default study."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from biogrip.study.validation import OVERRIDABLE, bound, schema

_BOUNDS = {
    "exclusiveMinimum": "> {}",
    "minimum": "≥ {}",
    "exclusiveMaximum": "< {}",
    "maximum": "≤ {}",
}
_NO_DEFAULT = "–"
_MOST_LISTED = 6


def reference(config: Path) -> str:
    """Return tables of all keys: meaning, unit, default, allowed values.

    Parameters
    ----------
    config
        YAML file of the default study.
    """
    defaults = yaml.safe_load(config.read_text(encoding="utf-8"))
    whole = schema()
    general: list[tuple[str, ...]] = []
    sections: list[str] = []
    for name, leaf in whole["properties"].items():
        block = _resolved(leaf)
        if "additionalProperties" in block and "properties" not in block:
            named = _resolved(block["additionalProperties"])
            keys = [
                row
                for key, part in named["properties"].items()
                if key not in OVERRIDABLE
                for row in _rows(f"{name}.NAME.{key}", _resolved(part), None)
            ]
            text = f"{block['description']} {named['description']}"
            sections.append(_section(name, text, keys))
        elif "properties" in block:
            rows = list(_rows(name, block, defaults.get(name)))
            sections.append(_section(name, block["description"], rows))
        else:
            general += _rows(name, block, defaults.get(name))
    return "\n\n".join([_section("General", "", general), *sections])


def _section(title: str, text: str, rows: list[tuple[str, ...]]) -> str:
    frame = pd.DataFrame(rows, columns=["key", "meaning", "unit", "default", "allowed"])
    table = frame.to_markdown(index=False, disable_numparse=True)
    return "\n\n".join(part for part in (f"### {title}", text, table) if part)


def _rows(path: str, block: Mapping[str, Any], default: Any) -> Iterator[tuple[str, ...]]:
    block = _resolved(block)
    items = _resolved(block.get("items", {}))
    if "properties" in block:
        for key, part in block["properties"].items():
            inner = default.get(key) if isinstance(default, Mapping) else None
            yield from _rows(f"{path}.{key}", part, inner)
    elif "properties" in items:
        shown = _NO_DEFAULT if default is None else "see Figure 3 in `config.yaml`"
        yield _row(path, block, shown)
        for key, part in items["properties"].items():
            yield from _rows(f"{path}[].{key}", part, None)
    else:
        yield _row(path, block, _NO_DEFAULT if default is None else _shown(default))


def _row(path: str, leaf: Mapping[str, Any], default: str) -> tuple[str, ...]:
    return f"`{path}`", leaf.get("description", ""), leaf.get("unit", ""), default, _allowed(leaf)


def _allowed(leaf: Mapping[str, Any]) -> str:
    if "enum" in leaf:
        return ", ".join(f"`{value}`" for value in leaf["enum"])
    if leaf["type"] == "array":
        low, high = leaf.get("minItems"), leaf.get("maxItems")
        most = " or more" if high is None else "" if low == high else f" to {high}"
        count = "" if low is None else f"{low}{most} "
        inner = _resolved(leaf["items"])
        if "enum" in inner:
            return f"list of {', '.join(f'`{value}`' for value in inner['enum'])}"
        return f"list of {count}{_kinds(inner['type'])} {_allowed_bounds(inner)}".strip()
    return f"{_kinds(leaf['type'])} {_allowed_bounds(leaf)}".strip()


def _kinds(type_: str | list[str]) -> str:
    words = {"string": "text", "object": "block", "array": "list"}
    kinds = type_ if isinstance(type_, list) else [type_]
    return " or ".join(words.get(kind, kind) for kind in kinds)


def _allowed_bounds(leaf: Mapping[str, Any]) -> str:
    limits = {key: bound(leaf[key]) for key in _BOUNDS if key in leaf}
    return ", ".join(_BOUNDS[key].format(limit) for key, limit in limits.items())


def _shown(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], str):
        listed = ", ".join(value)
        return f"`[{listed}]`" if len(value) <= _MOST_LISTED else f"{len(value)} keys"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def _resolved(leaf: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" not in leaf:
        return leaf
    name = leaf["$ref"].rsplit("/", 1)[1]
    found: Mapping[str, Any] = schema()["$defs"][name]
    return found
