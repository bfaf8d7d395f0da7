"""Columns of a sheet that are settings: config keys of a case, and names of blocks."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import Any

import yaml

from biogrip.errors import nearest
from biogrip.study.case_blocks import NAMABLE, OVERRIDABLE, CaseBlock
from biogrip.study.schema import Schema, schema_of
from biogrip.study.sheet_text import CELL
from biogrip.study.source import KeyPath
from biogrip.study.validation import some_case_problems
from biogrip.study.yaml_text import scalar_problem
from biogrip.traces.columns import shortened

BLOCKS = ("instrument", *NAMABLE)
"""Blocks of a case that may differ from row to row; others are for all traces of a config."""

FIXED, FIX = "fixed", "fix"
"""The block of known parameters, and a shorter word for it, as of the option ``--fix``."""

_OF_SAMPLE = ("model", "branches", "size_m")
_SIMULATED = ("measurement.rate_Hz", "measurement.noise", "models.target")
# Similarity from which a name without a dot is taken for a mistyped block.
_CLOSE = 0.85


@dataclass(frozen=True)
class Setting:
    """A column that sets a config key of its row's case."""

    path: tuple[str, ...]
    """The key, or the block that is named."""
    schema: Schema
    """What the key may have."""
    names_block: bool = False
    """True if cells are names of blocks that the config defines."""

    def value(self, text: str) -> tuple[Any, str | None]:
        """Return the value that a cell has as YAML, and what is wrong with it, if anything.

        Where a key takes text, a cell is text.
        """
        schema = self.schema
        kinds = {each.get("type", "number") for each in (schema.options or [schema])}
        if "string" in kinds:
            return text, self._problem(text)
        loader: Any = yaml.SafeLoader("")
        # Resolved as a plain scalar, so that no text of a cell is parsed as a list or a block.
        node = yaml.ScalarNode(loader.resolve(yaml.ScalarNode, text, (True, False)), text)
        if problem := scalar_problem(node):
            return None, problem
        try:
            value = schema.with_numbers(loader.construct_object(node))
        except (yaml.YAMLError, ValueError):
            value = text
        return value, self._problem(value)

    def _problem(self, value: Any) -> str | None:
        found = some_case_problems(nested(self.path, value))
        return next((text for path, text in found if path == self.path), None)


def nested(path: tuple[str, ...], value: Any) -> Any:
    """Return a value within the blocks of its key."""
    for part in reversed(path):
        value = {part: value}
    return value


def leaves(settings: Mapping[str, Any], above: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the paths of all keys of some blocks that are no blocks themselves."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*above, name))
        else:
            yield (*above, name)


@cache
def settings_by_column() -> dict[str, Setting]:
    """Return what columns may set by name, but for those of known parameters, see `setting_of`."""
    case = schema_of(CaseBlock)
    found: dict[str, Setting] = {}
    for name in BLOCKS:
        block = case.inside(name)
        found[name] = Setting((name,), block, names_block=name in NAMABLE)
        for setting in _single(block, (name,)):
            found[".".join(setting.path)] = setting
    for name in _OF_SAMPLE:
        found[f"sample.{name}"] = Setting(("sample", name), case.inside("sample").inside(name))
    return {name: it for name, it in found.items() if not _left_out(name)}


def setting_of(column: str) -> Setting | str | None:
    """Return what a column sets, None if it is a factor, or what is wrong with its name.

    Names without a dot that are no keys are factors, unless they seem to be mistyped keys.
    """
    known = settings_by_column()
    if column in known:
        return known[column]
    block, dot, key = column.partition(".")
    if dot and key and block in (FIXED, FIX):
        values = schema_of(CaseBlock).inside(FIXED).values
        return Setting((FIXED, key), values)
    if problem := _left_out(column):
        return problem
    if block in OVERRIDABLE and block not in BLOCKS:
        return "is for all traces; allowed is to say it in the config."
    if not dot:
        return _mistyped(column, known)
    if any(name.startswith(f"{column}.") for name in known):
        return "is a block of keys, allowed is one of its keys."
    if _exists(column):
        return f"is no single value, allowed is the column '{block}' with the name of a block."
    return f"is no key of a case.{nearest(column, known)} A factor has a name without a dot."


def _left_out(column: str) -> str | None:
    """Return why a key of a case is no setting of a recorded trace, if it is none."""
    if column == "measurement.file":
        return "is said by the column 'file'."
    if any(f"{column}.".startswith(f"{name}.") for name in _SIMULATED):
        return "is of simulated traces; leave it out."
    return None


def _mistyped(column: str, known: Mapping[str, Setting]) -> str | None:
    """Return a message about a name that is nearly a block's, or a key's without its block.

    So is one that is nearly that of cells, for each trace would be a cell of its own.
    """
    end = next((name for name in known if "." in name and name.rpartition(".")[2] == column), None)
    blocks = [CELL, *(name for name in known if "." not in name)]
    close = get_close_matches(column.lower(), blocks, n=1, cutoff=_CLOSE)
    if end and ("_" in column or close):
        hint = end
    elif close:
        hint = close[0]
    else:
        return None
    return f"is no known column. Did you mean '{hint}'? If it is a factor, give it another name."


def _single(block: Schema, path: tuple[str, ...]) -> Iterator[Setting]:
    """Yield all single values below a block."""
    named = block.get("propertyNames", {}).get("enum", ())
    for name, inner in {**block.keys, **dict.fromkeys(named, block.values)}.items():
        if any(each.is_single for each in (inner, *inner.options)):
            yield Setting((*path, name), inner)
        else:
            yield from _single(inner, (*path, name))


def _exists(column: str) -> bool:
    schema = schema_of(CaseBlock)
    for part in column.split("."):
        schema = schema.keys.get(part, Schema({}, {}))
    return bool(schema.node)


def shown(text: str) -> str:
    """Return a cell in quotes, of a long one the beginning."""
    return f"'{shortened(text)}'"
