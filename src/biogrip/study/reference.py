"""The description of every config key, as Markdown, from the schema and the default study."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from biogrip.study.validation import schema

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
        if name == "cases":
            keys = [
                row
                for key, part in _resolved(block["additionalProperties"])["properties"].items()
                if key not in whole["properties"]
                for row in _rows(f"cases.NAME.{key}", _resolved(part), None)
            ]
            text = _resolved(block["additionalProperties"])["description"]
            sections.append(_section("cases", f"{block['description']} {text}", keys))
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
        yield _row(path, block, "see Figure 3 in `config.yaml`")
        for key, part in items["properties"].items():
            yield from _rows(f"{path}[].{key}", part, None)
    else:
        yield _row(path, block, _NO_DEFAULT if default is None else _shown(default))


def _row(path: str, leaf: Mapping[str, Any], default: str) -> tuple[str, ...]:
    return f"`{path}`", leaf.get("description", ""), leaf.get("unit", ""), default, _allowed(leaf)


def _allowed(leaf: Mapping[str, Any]) -> str:
    if "enum" in leaf:
        return ", ".join(f"`{value}`" for value in leaf["enum"])
    bounds = ", ".join(text.format(leaf[key]) for key, text in _BOUNDS.items() if key in leaf)
    if leaf["type"] == "array":
        low, high = leaf.get("minItems"), leaf.get("maxItems")
        count = "" if low is None else f"{low} " if low == high else f"{low} to {high} "
        inner = _resolved(leaf["items"])
        if "enum" in inner:
            return f"list of {', '.join(f'`{value}`' for value in inner['enum'])}"
        return f"list of {count}{inner.get('type', 'values')} {_allowed_bounds(inner)}".strip()
    words = {"string": "text", "object": "block"}
    kinds = leaf["type"] if isinstance(leaf["type"], list) else [leaf["type"]]
    return f"{' or '.join(words.get(str(kind), str(kind)) for kind in kinds)} {bounds}".strip()


def _allowed_bounds(leaf: Mapping[str, Any]) -> str:
    return ", ".join(text.format(leaf[key]) for key, text in _BOUNDS.items() if key in leaf)


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
