"""Blocks that a config defines by name, for the columns of a sheet."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.keys import Problem
from biogrip.study.config import StudyConfig
from biogrip.study.messages import checked
from biogrip.study.schema import schema_of
from biogrip.study.source import ConfigFiles, dotted, read_config, read_places
from biogrip.study.validation import some_case_problems

KEY = "blocks"


@dataclass(frozen=True)
class NamedBlocks:
    """Blocks by the name of their key and their own."""

    by_key: Mapping[str, Mapping[str, Mapping[str, Any]]] = field(default_factory=dict)
    """The blocks, as in ``by_key["protocol"]["short"]``."""
    files: ConfigFiles = field(default_factory=lambda: ConfigFiles(()))
    """Where they are defined."""

    def of(self, key: str) -> Mapping[str, Mapping[str, Any]]:
        """Return the blocks of a key by name."""
        return self.by_key.get(key, {})

    def refuse_unused(self, used: Iterable[tuple[str, str]]) -> None:
        """Refuse blocks that no row names.

        Raises
        ------
        BiogripError
            With file, line and key of the first.
        """
        names = {*used}
        for key, blocks in self.by_key.items():
            for name in blocks:
                if (key, name) not in names:
                    path = KEY, key, name
                    raise BiogripError(
                        f"{self.files.place(path)}: {dotted(path)}: is named by no row of a sheet "
                        f"in a column '{key}'; allowed are blocks that are used."
                    )


def read_named_blocks(config: Path | None) -> NamedBlocks:
    """Read the blocks that a config defines by name.

    Raises
    ------
    BiogripError
        With file, line and key, if a block has a value or a key that is not allowed.
    """
    given = read_config(config) if config else {}
    if config is None or KEY not in given:
        return NamedBlocks()
    files = read_places([config])
    blocks = schema_of(StudyConfig).inside(KEY).with_numbers(given[KEY])
    problems = checked(StudyConfig, {KEY: blocks})[1]
    found = [(path, text) for path, text in problems if path[:1] == (KEY,)]
    for path, text in found or _problems(blocks):
        raise BiogripError(f"{files.place(path)}: {dotted(path)}: {text}")
    return NamedBlocks(blocks, files)


def _problems(blocks: Mapping[str, Mapping[str, Any]]) -> Iterator[Problem]:
    for key, named in blocks.items():
        for name, block in named.items():
            for path, text in some_case_problems({key: block}):
                yield (KEY, key, name, *path[1:]), text
            if key == "measurement" and "file" in block:
                yield (KEY, key, name, "file"), "is said by the column 'file' of a sheet."
