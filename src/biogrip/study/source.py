"""Where in which file a config key stands."""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from biogrip.errors import BiogripError

KeyPath = tuple[Hashable, ...]


@dataclass(frozen=True)
class ConfigFiles:
    """The YAML files of a study, the last laid over the ones before.

    Parameters
    ----------
    lines
        By file, the line (from 1) of every key and list item in it.
    command_line
        Top-level keys that the command line sets over all files.
    """

    lines: tuple[tuple[str, dict[KeyPath, int]], ...]
    command_line: frozenset[Hashable] = frozenset()

    def place(self, path: KeyPath) -> str:
        """Say where the value in force was set, e.g. ``"config/my.yaml, line 7"``.

        A key that is missing is placed at the block that lacks it.
        """
        if path and path[0] in self.command_line:
            return "command line, --config"
        for length in range(len(path), 0, -1):
            for name, lines in reversed(self.lines):
                if path[:length] in lines:
                    return f"{name}, line {lines[path[:length]]}"
        names = [name for name, _ in self.lines]
        return " with ".join(names) if names else "the configuration"


def read_places(files: Sequence[str | Path], command_line: Iterable[Hashable] = ()) -> ConfigFiles:
    """Read the places of all keys.

    Parameters
    ----------
    files
        YAML files, the last laid over the ones before.
    command_line
        Top-level keys that the command line sets over all files.

    Raises
    ------
    BiogripError
        If a file is missing, is not YAML, or gives a key twice.
    """
    lines = tuple((_relative(Path(file)), _lines(Path(file))) for file in files)
    return ConfigFiles(lines, frozenset(command_line))


def _relative(file: Path) -> str:
    """Name a file as the user would: relative to where they are, if it is below."""
    here = Path.cwd()
    return str(file.relative_to(here) if file.is_relative_to(here) else file)


def _lines(file: Path) -> dict[KeyPath, int]:
    try:
        root = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except OSError as error:
        raise BiogripError(f"{_relative(file)}: cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise BiogripError(f"{_relative(file)}: is not UTF-8 text.") from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise BiogripError(
            f"{_relative(file)}, line {line}: not valid YAML: {error.problem}."
        ) from error
    lines: dict[KeyPath, int] = {}
    if root is not None:
        try:
            _walk(file, root, (), lines)
        except RecursionError as error:
            raise BiogripError(f"{_relative(file)}: an alias contains itself.") from error
    return lines


def _walk(file: Path, node: yaml.Node, path: KeyPath, lines: dict[KeyPath, int]) -> None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*path, key.value)
            if inner in lines:
                name = ".".join(map(str, inner))
                line = key.start_mark.line + 1
                first = f"first in line {lines[inner]}"
                raise BiogripError(
                    f"{_relative(file)}, line {line}: {name} is given twice, {first}."
                )
            lines[inner] = key.start_mark.line + 1
            _walk(file, value, inner, lines)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            lines[(*path, index)] = value.start_mark.line + 1
            _walk(file, value, (*path, index), lines)
