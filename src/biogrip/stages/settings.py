"""What a job is told of the config: some of its keys, and nothing else.

A rule's ``params`` name keys of the config, a case's laid over the study's. In the job the same
keys make a `Case` or a `Study` again, in which any other key is missing: a rule that forgets to
name one fails, and cannot give a result that Snakemake would not renew.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter

import biogrip
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.plain import STRICT
from biogrip.study.study import Case, Study


def settings(study: Study, keys: Iterable[str], case: str = "") -> dict[str, Any]:
    """Return some keys of a study's config as plain values, those of a case laid over them.

    Parameters
    ----------
    study
        The study.
    keys
        Names of blocks, or of single keys in a block, e.g. ``measurement.noise``; or
        ``cases.NAME.KEY`` for a key of a case with the study's blocks merged in.
    case
        Name of the case, or of a point of a sweep; by default the study's own keys.

    Returns
    -------
    values
        By key; None for a default.
    """
    blocks = study.plain
    if case:
        # What the case leaves at its default is not the study's: it has all of its blocks.
        of_case = {field.name for field in fields(CaseBlock)}
        blocks = {key: value for key, value in blocks.items() if key not in of_case}
        blocks |= study.case(case).plain
    blocks = blocks | {"cases": {name: it.plain for name, it in study.cases.items()}}
    return {key: _value(blocks, key) for key in keys}


def keys_of_cases(study: Study, *keys: str) -> list[str]:
    """Return keys of every case, by default all, as ``cases.NAME.KEY``."""
    of_each = keys or [field.name for field in fields(CaseBlock)]
    return [f"cases.{name}.{key}" for name in study.cases for key in of_each]


def case_of(name: str, given: Mapping[str, Any]) -> Case:
    """Return a case of which some keys are given, by `settings`."""
    return Case(name, _partial(CaseBlock, given), Study(_partial(StudyConfig, given)))


def study_of(given: Mapping[str, Any]) -> Study:
    """Return a study of which, and of whose cases, some keys are given, by `settings`."""
    own: dict[str, Any] = {}
    cases: dict[str, dict[str, Any]] = {}
    for key, value in given.items():
        of, _, inner = key.partition(".")
        if of == "cases":
            name, _, inner = inner.partition(".")
            cases.setdefault(name, {})[inner] = value
        else:
            own[key] = value
    config = _partial(StudyConfig, own | {"cases": None})
    blocks = {name: _partial(CaseBlock, block) for name, block in cases.items()}
    object.__setattr__(config, "cases", blocks)
    return Study(config)


def _value(block: Mapping[str, Any] | None, key: str) -> Any:
    """Return the plain value of a dotted key; None for its default."""
    name, _, inner = key.partition(".")
    value = (block or {}).get(name)
    return _value(value, inner) if inner else value


@cache
def _adapter(kind: type, name: str) -> TypeAdapter[Any]:
    hint = get_type_hints(kind, include_extras=True)[name]
    return TypeAdapter(list[hint], config=STRICT)  # type: ignore[valid-type]


@cache
def _with_only(kind: Any, given: frozenset[str]) -> Any:
    """Return a class like that of a block, in which all other fields are errors."""
    absent = {field.name for field in fields(kind)} - given

    class Part(kind):  # type: ignore[misc]
        def __getattribute__(self, name: str) -> Any:
            if name in absent:
                raise AttributeError(f"{name} is not among the keys that the rule names.")
            return super().__getattribute__(name)

    return Part


def _partial(kind: Any, given: Mapping[str, Any]) -> Any:
    """Return a block with only the keys that are given; None stands for their default."""
    parts: dict[str, dict[str, Any]] = {}
    for key, value in given.items():
        name, _, inner = key.partition(".")
        parts.setdefault(name, {})[inner] = value
    own = [field for field in fields(kind) if field.name in parts]
    block = object.__new__(_with_only(kind, frozenset(field.name for field in own)))
    for field in own:
        part = parts[field.name]
        if "" not in part:
            value = _partial(get_type_hints(kind)[field.name], part)
        elif part[""] is not None:
            value = _adapter(kind, field.name).validate_json(json.dumps([part[""]]))[0]
        else:
            made = field.default_factory
            value = field.default if made is MISSING else made()
        object.__setattr__(block, field.name, value)
    return block


def software() -> dict[str, str]:
    """Return versions of what computes results, and a digest of our source."""
    folder = Path(biogrip.__file__).parent
    sources = sorted(file for file in folder.rglob("*") if file.suffix in (".py", ".j2", ".css"))
    digest = hashlib.sha256()
    for file in sources:
        digest.update(f"{file.relative_to(folder)}\n".encode())
        digest.update(file.read_bytes())
    versions = {name: version(name) for name in ("numpy", "scipy")}
    return {"biogrip": biogrip.__version__, **versions, "source": digest.hexdigest()[:12]}
