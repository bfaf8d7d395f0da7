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


def scalar_problem(node: yaml.ScalarNode) -> str | None:
    """Return what is wrong with a value that YAML 1.1 reads unexpectedly (dates, base 60)."""
    kind, text = node.tag.rpartition(":")[2], node.value
    if kind in ("int", "float") and ":" in text:
        reading = "in base 60; allowed is a number without colons"
    elif kind == "int" and _OCTAL.fullmatch(text):
        reading = "in base 8; allowed is a number that does not begin with 0"
    elif kind == "timestamp":
        reading = "as a date; allowed is a number"
    else:
        return None
    return f"found {text}, which YAML reads {reading}, or text in quotes."


def _refuse_deep(text: str, loader: Any) -> None:
    """Refuse blocks in blocks, by a `ValueError`, before those that read a tree end by them."""
    depth = 0
    for event in yaml.parse(text, loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise ValueError(f"found more than {_DEEPEST} levels, allowed are fewer")


def value_of(text: str, key: str = "") -> Any:
    """Read the value of a key as YAML, units as text; refuse what is not read as it looks."""
    if key.endswith("_unit"):
        return text
    try:
        _refuse_deep(text, yaml.SafeLoader)
        node = yaml.compose(text, yaml.SafeLoader)
        problem = scalar_problem(node) if isinstance(node, yaml.ScalarNode) else None
        if any(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)):
            # One of itself has no end.
            raise ValueError("found an alias, allowed is the value itself")
        value = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:
        problem = f"not valid YAML: {' '.join(str(error).split())}."
    if problem:
        raise BiogripError(problem)
    return value


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
        raise _wrong(file, None, f"found more than {LARGEST_BYTES} bytes; allowed are fewer.")
    try:
        return _parsed(file, content.decode("utf-8"))
    except UnicodeDecodeError as error:
        found = f"found the byte 0x{content[error.start]:02x}, allowed is text in UTF-8."
        raise _wrong(file, content.count(b"\n", 0, error.start) + 1, found) from error
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        said = getattr(error, "problem", None) or " ".join(str(error).split())
        raise _wrong(file, mark and mark.line + 1, f"not valid YAML: {said}.") from error


# The defaults are read again for every trace.
@lru_cache(maxsize=16)
def _parsed(file: Path, text: str) -> tuple[Lines, dict[str, Any]]:
    _refuse_deep(text, _Loader)
    root = yaml.compose(text, Loader=_Loader)
    lines: dict[KeyPath, int] = {}
    if root is None:
        return lines, {}
    if not isinstance(root, yaml.MappingNode):
        raise _wrong(file, 1, "found no keys, allowed is a config.")
    _walk(file, root, (), lines)
    content = yaml.SafeLoader("").construct_document(root)
    # It may come by a merge.
    if "__use_yte__" in content:
        text = "with __use_yte__ a config is a program. `snakemake --configfile` runs it before it "
        text += "reads any rule: there it has run by now. `biogrip` has not run it. Allowed is a "
        raise _wrong(file, lines.get(("__use_yte__",), 1), f"{text}config without it.")
    return lines, content


def _walk(file: Path, node: yaml.Node, path: KeyPath, lines: dict[KeyPath, int]) -> None:
    """Collect the lines of keys and items, and refuse what stands twice or would be misread."""
    line = node.start_mark.line + 1
    if len(path) > _DEEPEST or len(lines) > _MOST_KEYS:
        text = f"found more than {_DEEPEST} levels or {_MOST_KEYS} values, those of an alias"
        raise _wrong(file, line, f"{text} counted wherever it is used; allowed are fewer.")
    if isinstance(node, yaml.ScalarNode) and (problem := scalar_problem(node)):
        raise _wrong(file, line, f"{dotted(path)}: {problem}")
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            named = isinstance(key, yaml.ScalarNode)
            inner, at = (*path, key.value if named else "?"), key.start_mark.line + 1
            if not key.tag.endswith((":str", ":merge")):
                text = "is no text: YAML reads on, off, yes, no and numbers otherwise; put it in"
                raise _wrong(file, at, f"{dotted(inner)}: {text} quotes.")
            if inner in lines:
                text = f"is given twice, first in line {lines[inner]}."
                raise _wrong(file, at, f"{dotted(inner)}: {text}")
            lines[inner] = at
            _walk(file, value, inner, lines)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            lines[(*path, index)] = value.start_mark.line + 1
            _walk(file, value, (*path, index), lines)


def _wrong(file: Path, line: int | None, text: str) -> BiogripError:
    place = f", line {line}" if line else ""
    return BiogripError(f"{shown_path(file)}{place}: {text}")
