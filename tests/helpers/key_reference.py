"""Reference of all config keys in Markdown, and the JSON Schema of config files."""

import ast
import inspect
import json
import re
import textwrap
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import pandas as pd
from pydantic import TypeAdapter

from biogrip.config.loading import Schema, bound, read_configs, tidy
from biogrip.keys import Checked
from biogrip_study.config.study import DEFAULTS
from biogrip_study.config.study_blocks import OVERRIDABLE, StudyConfig, ValueBlock

_MOST_LISTED = 6
_SIGNS = {"exclusiveMinimum": ">", "minimum": "≥", "maximum": "≤"}
_UNITS = {
    **{name: name for name in ("s", "m", "Hz", "rad", "deg", "V")},
    "percent": "%",
    **{"Nm": "N m", "Nms": "N m s", "kgm2": "kg m²"},
    **{"Nms_per_rad": "N m s/rad", "Nm_per_rad": "N m/rad"},
}
_ENDS = re.compile(rf".*?_({'|'.join(_UNITS)})")
_WORDS = {"string": "text", "object": "block"}


@cache
def documented() -> dict[str, Any]:
    """Return the JSON Schema of a config, with the docstrings of keys, which jobs do not read."""
    schema = tidy(TypeAdapter(StudyConfig).json_schema())
    for kind in (*_kinds(Checked), ValueBlock):
        node = schema if kind is StudyConfig else schema["$defs"].get(kind.__name__, {})
        for key, said in _docstrings(kind).items():
            inner = node.get("properties", {}).get(key)
            if key == "__pydantic_extra__":
                inner = node["additionalProperties"]
            if inner is not None:
                inner["description"] = said
    return _shortened(schema)


def _kinds(kind: Any) -> list[Any]:
    kinds = [kind]
    for subclass in kind.__subclasses__():
        kinds += _kinds(subclass)
    return kinds


def _docstrings(kind: type) -> dict[str, str]:
    """Return what stands below the fields of a class, and of those that it inherits from."""
    found: dict[str, str] = {}
    for base in kind.__mro__[::-1]:
        # Those of methods are made without a source.
        if base.__module__.startswith("biogrip") and base.__name__ != "_MethodBlocks":
            (tree,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
            pairs: Any = pairwise(tree.body)  # type: ignore[attr-defined]
            for pair in pairs:
                match pair:
                    case ast.AnnAssign(target=ast.Name(name)), ast.Expr(ast.Constant(str(text))):
                        found[name] = inspect.cleandoc(text)
    return found


def _shortened(node: Any, name: str = "") -> Any:
    """Return a schema with units where names have one, and descriptions of one paragraph.

    Its keys stand in alphabetic order.
    """
    if isinstance(node, list):
        return [_shortened(item) for item in node]
    if name == "description" and isinstance(node, str):
        return node.partition("\n\n")[0].replace("\n", " ")
    if not isinstance(node, Mapping):
        return node
    if name not in ("properties", "$defs"):
        return {key: _shortened(node[key], key) for key in sorted(node)}
    units = {key: {"unit": _UNITS[end[1]]} for key in node if (end := _ENDS.fullmatch(key))}
    return {key: _shortened(node[key] | units.get(key, {}), key) for key in node}


def leaves(block: Schema, path: str = "") -> dict[str, Schema]:
    """Every key of a block and below, with what its value may look like."""
    found: dict[str, Schema] = {}
    for name, schema in block.keys.items():
        own = f"{path}{name}"
        found |= {own: schema} | leaves(schema, f"{own}.") | leaves(schema.values, f"{own}.NAME.")
        for part in (schema.inside(0), *schema.inside(0).options):
            found |= leaves(part, f"{own}[].")
    return found


def reference() -> str:
    """Return Markdown tables of all keys: meaning, unit, default, allowed values.

    Where the default config gives no default it is that of the class.
    """
    defaults: Any = read_configs(DEFAULTS)
    sections: dict[str, list[tuple[str, ...]]] = {"General": []}
    for path, schema in leaves(STUDY).items():
        top, *inner = path.split(".")
        inherited = path.startswith("cases.NAME.") and inner[1] in OVERRIDABLE
        if schema.keys and schema.values.node:
            path, schema = f"{path}.NAME", schema.values
        if schema.keys or schema.values.keys or inherited:
            continue
        default = defaults
        for part in path.split("."):
            default = default.get(part) if isinstance(default, Mapping) else None
        rows = sections.setdefault(top if inner else "General", [])
        told = schema.get("description", ""), schema.get("unit", "")
        rows.append((f"`{path}`", *told, _default(schema, default), _allowed(schema)))
    found = []
    for name, rows in sections.items():
        frame = pd.DataFrame(rows, columns=["key", "meaning", "unit", "default", "allowed"])
        found += [f"### {name}", STUDY.inside(name).get("description", "")]
        found.append(frame.to_markdown(index=False, disable_numparse=True))
    return "\n\n".join(filter(None, found))


def _default(schema: Schema, default: Any) -> str:
    if schema.inside(0).keys and default is not None:
        return "see `config.yaml`"
    value = schema.get("default") if default is None else default
    if value in (None, [], {}):
        return "–"
    if isinstance(value, list) and isinstance(value[0], str):
        shown = f"`[{', '.join(value)}]`"
        return shown if len(value) <= _MOST_LISTED else f"{len(value)} keys"
    shown = f"{value:g}" if isinstance(value, float) else str(value)
    return f"`{shown.lower() if isinstance(value, bool) else shown}`"


def file_schema() -> str:
    """Return the JSON Schema of a config file, with all keys optional, as files are merged."""
    schema = _partial(documented())
    cases = schema["properties"]["cases"]
    ((name, case),) = cases["patternProperties"].items()
    # A case set to null is dropped.
    cases["patternProperties"] = {name: {"anyOf": [case, {"type": "null"}]}}
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


def _partial(node: Any, name: str = "") -> Any:
    if isinstance(node, Mapping):
        left = {"required", "title", "default", "form"} if name != "properties" else set()
        return {key: _partial(inner, key) for key, inner in node.items() if key not in left}
    if isinstance(node, list):
        return [_partial(item) for item in node]
    if name == "pattern":
        # \w of a JSON Schema matches ASCII letters only.
        return node.replace(r"\w", r"\w\u00aa-\uffff")
    # Pydantic versions differ in writing integral numbers as int or float.
    return int(node) if isinstance(node, float) and node.is_integer() else node


def _allowed(schema: Schema) -> str:
    if schema.options:
        return " or ".join(_allowed(option) for option in schema.options)
    if "enum" in schema.node:
        return _listed(schema.get("enum"))
    if schema.get("type") == "array":
        return _list_allowed(schema)
    if schema.get("type") == "object" and not schema.keys:
        names = schema.get("propertyNames", {}).get("enum")
        which = f" of {_listed(names)}" if names else ""
        return f"block{which}: {_allowed(schema.values)}" if schema.values.node else "block"
    limits = {sign: schema.get(name) for name, sign in _SIGNS.items()}
    bounds = [f"{sign} {bound(limit)}" for sign, limit in limits.items() if limit is not None]
    kind = schema.get("type", "block")
    return f"{_WORDS.get(kind, kind)} {', '.join(bounds)}".strip()


def _list_allowed(schema: Schema) -> str:
    fewest, most, item = schema.get("minItems"), schema.get("maxItems"), schema.inside(0)
    if fewest is None or "enum" in item.node:
        return f"list of {_allowed(item)}"
    count = fewest if fewest == most else f"{fewest} {f'to {most}' if most else 'or more'}"
    return f"list of {count} {_allowed(item)}"


def _listed(choices: list[str]) -> str:
    return ", ".join(f"`{choice}`" for choice in choices)


STUDY = Schema(documented(), documented()["$defs"])
"""Schema of the top-level keys."""
