"""Reference of all config keys in Markdown, and the JSON Schema of config files."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.config import StudyConfig
from biogrip.study.messages import bound
from biogrip.study.models import json_schema
from biogrip.study.typed import Shape, keys, spread

_NO_DEFAULT = "–"
_MOST_LISTED = 6
_WORDS = {int: "integer", float: "number", str: "text", bool: "boolean"}

_Row = tuple[str, str, str, str, str]


def reference(config: Path) -> str:
    """Return Markdown tables of all keys: meaning, unit, default, allowed values.

    Parameters
    ----------
    config
        YAML file of the default study.
    """
    defaults = yaml.safe_load(config.read_text(encoding="utf-8"))
    general: list[_Row] = []
    sections: list[str] = []
    for name, entry in keys(StudyConfig).items():
        shape = entry.shape
        named = shape.values.block if shape.values else None
        if named:
            own = {key: e.shape for key, e in keys(named).items() if key not in OVERRIDABLE}
            rows = [
                row
                for key, inner in own.items()
                for row in _rows(f"{name}.NAME.{key}", inner, None)
            ]
            sections.append(_section(name, shape.text, rows))
        elif shape.block:
            rows = list(_rows(name, shape, defaults.get(name)))
            sections.append(_section(name, shape.text, rows))
        else:
            general += _rows(name, shape, defaults.get(name))
    return "\n\n".join([_section("General", "", general), *sections])


def file_schema() -> str:
    """Return the JSON Schema of a config file, with all keys optional, as files are merged."""
    schema = _partial(json_schema(StudyConfig))
    cases = schema["properties"]["cases"]
    ((name, case),) = cases["patternProperties"].items()
    # A case set to null is dropped.
    cases["patternProperties"] = {name: {"anyOf": [case, {"type": "null"}]}}
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def _partial(node: Any, name: str = "") -> Any:
    if isinstance(node, Mapping):
        left = {"required", "title", "default"} if name != "properties" else set()
        return {key: _partial(inner, key) for key, inner in node.items() if key not in left}
    if isinstance(node, list):
        return [_partial(item) for item in node]
    # Pydantic versions differ in writing integral numbers as int or float.
    return int(node) if isinstance(node, float) and node.is_integer() else node


def _section(title: str, text: str, rows: list[_Row]) -> str:
    frame = pd.DataFrame(rows, columns=["key", "meaning", "unit", "default", "allowed"])
    table = frame.to_markdown(index=False, disable_numparse=True)
    return "\n\n".join(part for part in (f"### {title}", text, table) if part)


def _rows(path: str, shape: Shape, default: Any) -> Iterator[_Row]:
    items = shape.items.block if shape.items else None
    if shape.block:
        for key, entry in keys(shape.block).items():
            inner = default.get(key) if isinstance(default, Mapping) else None
            yield from _rows(f"{path}.{key}", entry.shape, inner)
        rest = spread(shape.block)
        if rest and rest.shape.values:
            values = rest.shape.values
            said = replace(values, key=replace(values.key, text=rest.shape.text))
            yield _row(f"{path}.NAME", said, _NO_DEFAULT)
    elif items:
        shown = _NO_DEFAULT if default is None else "see Figure 3 in `config.yaml`"
        yield _row(path, shape, shown)
        for key, entry in keys(items).items():
            yield from _rows(f"{path}[].{key}", entry.shape, None)
    else:
        yield _row(path, shape, _NO_DEFAULT if default is None else _shown(default))


def _row(path: str, shape: Shape, default: str) -> _Row:
    return f"`{path}`", shape.text, shape.key.unit, default, _allowed(shape)


def _allowed(shape: Shape) -> str:
    key = shape.key
    if shape.options:
        return " or ".join(_allowed(option) for option in shape.options)
    if key.choices:
        return _listed(key.choices)
    if shape.items:
        if shape.items.key.choices:
            return f"list of {_allowed(shape.items)}"
        most = " or more" if key.most is None else f" to {key.most}"
        count = "" if key.fewest is None else f"{key.fewest}{most} "
        if key.fewest is not None and key.fewest == key.most:
            count = f"{key.fewest} "
        return f"list of {count}{_allowed(shape.items)}"
    if shape.names and shape.values:
        if shape.values.scalar is object:
            return "block"
        names = f" of {_listed(shape.names.key.choices)}" if shape.names.key.choices else ""
        return f"block{names}: {_allowed(shape.values)}"
    limits = {"> ": key.above, "≥ ": key.low, "≤ ": key.high}
    bounds = [f"{sign}{bound(limit)}" for sign, limit in limits.items() if limit is not None]
    kind = _WORDS.get(shape.scalar, "block") if shape.scalar else "block"
    return f"{kind} {', '.join(bounds)}".strip()


def _listed(choices: tuple[str, ...]) -> str:
    return ", ".join(f"`{choice}`" for choice in choices)


def _shown(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], str):
        listed = ", ".join(value)
        return f"`[{listed}]`" if len(value) <= _MOST_LISTED else f"{len(value)} keys"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"
