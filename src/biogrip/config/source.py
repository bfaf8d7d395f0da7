"""YAML config files: what they hold, and in which line each key stands.

YAML of Python is YAML 1.1, which reads ``1:30`` in base 60 and ``010`` in base 8; such values, keys
that are given twice, and files that are too large are refused.
"""

import re
from collections.abc import Hashable, Iterator, Mapping, Sequence
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from biogrip.errors import BiogripError
from biogrip.terminal import visible

KeyPath = tuple[Hashable, ...]
Lines = Mapping[KeyPath, int | None]
Source = tuple[str, Lines]
"""Name of a file or of another source of keys, and the line (from 1) of each that it has."""

HOLD, RAMP = ("--hold",), ("--ramp",)
"""Paths of the settings that are no keys: what is controlled from 0 to the end of the trace, and in
how many s that is reached."""

LARGEST_BYTES = 1_000_000
"""Bytes of a config file at most."""

# Aliases of aliases make many values of a few lines, and endless ones of an alias of itself.
_MOST_KEYS, _DEEPEST = 100_000, 50
# libyaml is ten times faster, but not part of every PyYAML.
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_OCTAL = re.compile(r"[-+]?0[0-7_]+")


def values_in(block: Any, above: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Yield all values of a block and of the blocks and lists below, with their paths."""
    if isinstance(block, list | tuple):
        block = dict(enumerate(block))
    for key, inner in block.items() if isinstance(block, Mapping) else ():
        yield (*above, key), inner
        yield from values_in(inner, (*above, key))


def keys_in(block: Any, above: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the paths of all keys and list items of a block and of the blocks below."""
    return (path for path, _ in values_in(block, above))


def place(path: KeyPath, sources: Sequence[Source]) -> str:
    """Return which source has a key, or the block that lacks it: ``"my.yaml, line 7"``."""
    for length in range(len(path), 0, -1):
        for name, lines in reversed(sources):
            if path[:length] in lines:
                line = lines[path[:length]]
                return f"{name}, line {line}" if line else name
    return " with ".join(name for name, _ in sources) or "the configuration"


def read_source(file: Path) -> Source:
    """Return the name of a YAML file, and the lines of all in it; see `read_config` for errors."""
    return shown_path(file), _read(file)[0]


def read_config(file: Path) -> dict[str, Any]:
    """Read the keys of one YAML file; a `BiogripError` names the line of what is not usable."""
    return deepcopy(_read(file)[1])


def overlaid(base: Any, over: Any) -> Any:
    """Merge a config block over another: mappings recursively, all else replaced, not copied."""
    if isinstance(base, dict) and isinstance(over, dict):
        merged = {key: overlaid(base[key], it) if key in base else it for key, it in over.items()}
        return base | merged
    return over


def shown_path(file: Path) -> str:
    """Return a path relative to the working directory, if it is below."""
    here = Path.cwd()
    return visible(file.relative_to(here) if file.is_relative_to(here) else file)


def dotted(path: KeyPath) -> str:
    """Return a key as messages name it, e.g. ``protocol.phases[0].duration_s``."""
    text = ""
    for part in path:
        name = visible(part)
        text += f"[{name}]" if isinstance(part, int) else f".{name}" if text else name
    return text or "the file"


def value_of(text: str, key: str = "") -> Any:
    """Read the value of a key as YAML, units as text; refuse what is not read as it looks."""
    if key.endswith("_unit"):
        return text
    try:
        return deepcopy(_parsed(text)[1])
    except (yaml.YAMLError, ValueError) as error:
        raise BiogripError(_line_and_problem(error)[1]) from error


def _read(file: Path) -> tuple[Lines, dict[str, Any]]:
    """Return the line number of every key, and the content of the file."""
    # A pipe that nobody writes to would be waited for.
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise BiogripError(f"{shown_path(file)}: is no regular file; allowed is one.")
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        where = f" in the folder {visible(file.parent.absolute())}"
        text = f"cannot be read: {error.strerror}{'' if file.exists() else where}."
        raise BiogripError(f"{shown_path(file)}: {text}") from error
    if len(content) > LARGEST_BYTES:
        text = f"found more than {LARGEST_BYTES} bytes; allowed are fewer."
        raise BiogripError(f"{shown_path(file)}: {text}")
    try:
        lines, config = _parsed(content.decode("utf-8"))
    except (yaml.YAMLError, ValueError) as error:
        line, problem = _line_and_problem(error)
        place = f", line {line}" if line else ""
        raise BiogripError(f"{shown_path(file)}{place}: {problem}") from error
    if not isinstance(config or {}, dict):
        raise BiogripError(f"{shown_path(file)}: found no keys, allowed is a config.")
    return lines, config or {}


def _line_and_problem(error: Exception) -> tuple[int | None, str]:
    """Return where YAML cannot be used, and why."""
    if isinstance(error, UnicodeDecodeError):
        found, line = error.object[error.start], error.object.count(b"\n", 0, error.start) + 1
        return line, f"found the byte 0x{found:02x}, allowed is text in UTF-8."
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    problem = getattr(error, "problem", None) or " ".join(str(error).split())
    return mark and mark.line + 1, f"not usable YAML: {problem.removesuffix('.')}."


# The defaults are read again for every trace.
@lru_cache(maxsize=16)
def _parsed(text: str) -> tuple[Lines, Any]:
    """Return the lines of keys and items of YAML, and its content."""
    depth = 0
    # Before those that read a tree end by it.
    for event in yaml.parse(text, _Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        _refuse_many(event, depth, 0)
    root = yaml.compose(text, Loader=_Loader)
    lines: dict[KeyPath, int] = {}
    if root is None:
        return lines, None
    _walk(root, (), lines)
    return lines, yaml.SafeLoader("").construct_document(root)


def _refuse(at: Any, path: KeyPath, problem: str) -> None:
    """Refuse a node, or what begins one, by a `yaml.YAMLError` with its line and key."""
    key = f"{dotted(path)}: " if path else ""
    raise yaml.MarkedYAMLError(problem=f"{key}{problem}", problem_mark=at.start_mark)


def _refuse_many(at: Any, levels: int, keys: int) -> None:
    if levels > _DEEPEST or keys > _MOST_KEYS:
        text = f"found more than {_DEEPEST} levels or {_MOST_KEYS} values, those of an alias"
        _refuse(at, (), f"{text} counted wherever it is used; allowed are fewer")


def _walk(node: yaml.Node, path: KeyPath, lines: dict[KeyPath, int]) -> None:
    """Collect the lines of keys and items, and refuse what stands twice or would be misread."""
    _refuse_many(node, len(path), len(lines))
    if isinstance(node, yaml.ScalarNode):
        _refuse_misread(node, path)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            lines[(*path, index)] = value.start_mark.line + 1
            _walk(value, (*path, index), lines)
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*path, key.value if isinstance(key, yaml.ScalarNode) else "?")
            if not key.tag.endswith((":str", ":merge")):
                text = "is no text: YAML reads on, off, yes, no and numbers otherwise; put it in"
                _refuse(key, inner, f"{text} quotes")
            if inner in lines:
                _refuse(key, inner, f"is given twice, first in line {lines[inner]}")
            lines[inner] = key.start_mark.line + 1
            _walk(value, inner, lines)


def _refuse_misread(node: yaml.ScalarNode, path: KeyPath) -> None:
    """Refuse a value that YAML 1.1 reads unexpectedly (dates, base 60)."""
    kind, text = node.tag.rpartition(":")[2], node.value
    if kind in ("int", "float") and ":" in text:
        reading = "in base 60; allowed is a number without colons"
    elif kind == "int" and _OCTAL.fullmatch(text):
        reading = "in base 8; allowed is a number that does not begin with 0"
    elif kind == "timestamp":
        reading = "as a date; allowed is a number"
    else:
        return
    _refuse(node, path, f"found {text}, which YAML reads {reading}, or text in quotes")
