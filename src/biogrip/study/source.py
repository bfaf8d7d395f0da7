"""Keys of config files with their line numbers, for error messages."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from biogrip.errors import BiogripError
from biogrip.study.yaml_text import compose, no_yaml, read_text, scalar_problem, shown_path

KeyPath = tuple[Hashable, ...]

_RUNS_CODE: KeyPath = ("__use_yte__",)
_LONGEST_NAME = 80


@dataclass(frozen=True)
class ConfigFiles:
    """Config files of a study with line numbers, the later merged over the earlier."""

    lines: tuple[tuple[str, Mapping[KeyPath, int]], ...]
    """Line (from 1) of every key and list item, by file."""
    command_line: frozenset[Hashable] = frozenset()
    """Top-level keys set on the command line, which override all files."""
    over: tuple[tuple[str, Mapping[KeyPath, int]], ...] = ()
    """Lines of the keys of a row in a table of traces, by the table, which override even these."""

    def place(self, path: KeyPath) -> str:
        """Return where the value in force was set, e.g. ``"config/my.yaml, line 7"``.

        For a missing key it is the block that lacks it.
        """
        if found := _line_of(path, self.over):
            return found
        if path and path[0] in self.command_line:
            return "command line, --config"
        if found := _line_of(path, self.lines):
            return found
        names = [name for name, _ in self.lines]
        return " with ".join(names) if names else "the configuration"


def _line_of(path: KeyPath, files: Sequence[tuple[str, Mapping[KeyPath, int]]]) -> str | None:
    """Return the last of some files that has a key, or a block that it is in, and the line."""
    for length in range(len(path), 0, -1):
        for name, lines in reversed(files):
            if path[:length] in lines:
                return f"{name}, line {lines[path[:length]]}"
    return None


def read_places(files: Sequence[str | Path], command_line: Iterable[Hashable] = ()) -> ConfigFiles:
    """Read the line numbers of all keys in YAML files, the later merged over the earlier.

    Top-level keys set on the command line override all files.

    Raises
    ------
    BiogripError
        With file and line, if a file is no valid config at all, see `read_config`.
    """
    lines = tuple((shown_path(Path(file)), _read(Path(file))[0]) for file in files)
    return ConfigFiles(lines, frozenset(command_line))


def read_config(file: Path) -> dict[str, Any]:
    """Read the keys of one YAML file.

    Raises
    ------
    BiogripError
        With file and line, if the file is missing or is not a YAML mapping within the bounds of
        `compose`, has a duplicate key, or a value that YAML 1.1 misreads, see `scalar_problem`.
    """
    return _read(file)[1]


def overlaid(base: Any, over: Any) -> Any:
    """Merge a config block over another: mappings recursively, all else replaced, not copied."""
    if isinstance(base, dict) and isinstance(over, dict):
        merged = dict(base)
        for key, value in over.items():
            merged[key] = overlaid(merged[key], value) if key in merged else value
        return merged
    return over


def _read(file: Path) -> tuple[Mapping[KeyPath, int], dict[str, Any]]:
    """Return the line number of every key, and the content of the file."""
    lines, content = _parsed(file, read_text(file))
    return lines, deepcopy(content)


# The default study is read again for every trace.
@lru_cache(maxsize=16)
def _parsed(file: Path, text: str) -> tuple[dict[KeyPath, int], dict[str, Any]]:
    root = compose(file, text)
    lines: dict[KeyPath, int] = {}
    if root is None:
        return lines, {}
    if not isinstance(root, yaml.MappingNode):
        raise BiogripError(f"{shown_path(file)}, line 1: found no keys, allowed is a config.")
    _walk(file, root, (), lines)
    if _RUNS_CODE in lines:
        raise BiogripError(
            f"{shown_path(file)}, line {lines[_RUNS_CODE]}: {_RUNS_CODE[0]} makes Snakemake run "
            "code that stands in the file; allowed is a config without it."
        )
    try:
        return lines, yaml.SafeLoader("").construct_document(root)
    except yaml.MarkedYAMLError as error:
        raise no_yaml(file, error) from error


def _walk(file: Path, node: yaml.Node, path: KeyPath, lines: dict[KeyPath, int]) -> None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _wrong(file, key, path, "has a block or list as a key, allowed is text.")
            inner = (*path, key.value)
            if inner in lines:
                raise _wrong(file, key, inner, f"is given twice, first in line {lines[inner]}.")
            _refuse_misread(file, key, inner)
            lines[inner] = key.start_mark.line + 1
            _walk(file, value, inner, lines)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            lines[(*path, index)] = value.start_mark.line + 1
            _walk(file, value, (*path, index), lines)
    elif isinstance(node, yaml.ScalarNode):
        _refuse_misread(file, node, path)


def _refuse_misread(file: Path, node: yaml.ScalarNode, path: KeyPath) -> None:
    if problem := scalar_problem(node):
        raise _wrong(file, node, path, problem)


def _wrong(file: Path, node: yaml.Node, path: KeyPath, text: str) -> BiogripError:
    line = node.start_mark.line + 1
    return BiogripError(f"{shown_path(file)}, line {line}: {dotted(path)}: {text}")


def dotted(path: KeyPath) -> str:
    """Return a key as messages name it, e.g. ``protocol.phases[0].duration_s``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            name = str(part)
            name = name if name.isprintable() else repr(name)
            name = name if len(name) <= _LONGEST_NAME else f"{name[:_LONGEST_NAME]}..."
            text += f".{name}" if text else name
    return text or "the file"
