"""What a job is told: some keys of the config, the seeds of its batch, and its files.

A rule's ``params`` are some keys of the config as plain values, those of its case laid over the
study's (`settings`). Its script makes a `Case` or a `Study` of these again (`job_case`,
`job_study`), in which every other key is an error: a rule that forgets to name one fails, and
cannot give a result that Snakemake would not renew. Each job has a batch of the case's seeds
(`batch_names`, `job_seeds`), and writes what it says to its log (`logged`).
"""

import hashlib
import json
import re
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr
from dataclasses import MISSING, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter

import biogrip
from biogrip.errors import BiogripError
from biogrip.keys import STRICT
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.study import Case, Study

_BATCH = re.compile(r"seeds_(\d+)-(\d+)")
_OF_CASE = [field.name for field in fields(CaseBlock)]


def settings(study: Study, keys: Iterable[str], case: str = "") -> dict[str, Any]:
    """Return some keys of a study, or of a case or a point of a sweep, plain; None for a default.

    Keys name blocks, or single keys in a block, e.g. ``measurement.noise``; or ``cases.NAME.KEY``
    for a key of a case with the study's blocks merged in.
    """
    blocks = study.plain
    if case:
        # What the case leaves at its default is not the study's: it has all of its blocks.
        blocks = {key: value for key, value in blocks.items() if key not in _OF_CASE}
        blocks |= study.case(case).plain
    blocks = blocks | {"cases": {name: it.plain for name, it in study.cases.items()}}

    def value_of(block: Mapping[str, Any] | None, key: str) -> Any:
        name, _, inner = key.partition(".")
        value = (block or {}).get(name)
        return value_of(value, inner) if inner else value

    return {key: value_of(blocks, key) for key in keys}


def keys_of_cases(study: Study, *keys: str) -> list[str]:
    """Return keys of every case, by default all, as ``cases.NAME.KEY``."""
    return [f"cases.{name}.{key}" for name in study.cases for key in keys or _OF_CASE]


def case_of(name: str, given: Mapping[str, Any]) -> Case:
    """Return a case of which some keys are given, by `settings`."""
    return Case(name, _partial(CaseBlock, given), Study(_partial(StudyConfig, given)))


def study_of(given: Mapping[str, Any]) -> Study:
    """Return a study of which, and of whose cases, some keys are given, by `settings`."""
    own: dict[str, Any] = {"cases": None}
    cases: dict[str, dict[str, Any]] = {}
    for key, value in given.items():
        if key.startswith("cases."):
            _, name, inner = key.split(".", 2)
            cases.setdefault(name, {})[inner] = value
        else:
            own[key] = value
    config = _partial(StudyConfig, own)
    blocks = {name: _partial(CaseBlock, block) for name, block in cases.items()}
    object.__setattr__(config, "cases", blocks)
    return Study(config)


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


def software() -> dict[str, str]:
    """Return versions of what computes results, and a digest of our source."""
    folder = Path(biogrip.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*")):
        if file.suffix in (".py", ".j2", ".css"):
            digest.update(f"{file.relative_to(folder)}\n".encode())
            digest.update(file.read_bytes())
    versions = {name: version(name) for name in ("numpy", "scipy")}
    return {"biogrip": biogrip.__version__, **versions, "source": digest.hexdigest()[:12]}


def seeds_of(batch: str) -> range:
    """Return the seeds of a batch, whose name has the first and the last, e.g. ``seeds_0-24``."""
    found = _BATCH.fullmatch(batch)
    assert found, batch
    return range(int(found[1]), int(found[2]) + 1)


def batch_names(seeds: int, size: int) -> list[str]:
    """Return the names of the batches of a case, cut at multiples of their size."""
    starts = range(0, seeds, size)
    return [f"seeds_{first}-{min(first + size, seeds) - 1}" for first in starts]


@contextmanager
def logged(job: Any) -> Iterator[None]:
    """Write what is said to the job's log; an error of ours ends it with its message alone."""
    with Path(job.log[0]).open("w", encoding="utf-8") as stream, redirect_stderr(stream):
        try:
            yield
        except BiogripError as error:
            print(f"biogrip: {error}", file=stream)
            raise SystemExit(1) from error
        except Exception:
            traceback.print_exc(file=stream)
            raise


def job_case(job: Any) -> Case:
    """Return the case of a job, with the keys of the config that its rule names."""
    return case_of(job.wildcards.case, job_settings(job))


def job_study(job: Any) -> Study:
    """Return the study of a job, with the keys of the config that its rule names."""
    return study_of(job_settings(job))


def job_settings(job: Any) -> dict[str, Any]:
    """Return the keys of the config that a job's rule names, as plain values."""
    given = {key: value for param in job.params for key, value in param.items()}
    del given["software"]
    return given


def job_seeds(job: Any) -> list[int]:
    """Return the seeds of a job's batch."""
    return list(seeds_of(job.wildcards.batch))


def paths(files: Any) -> list[Path]:
    """Return files of Snakemake as paths; one file is a list of one."""
    return [Path(files)] if isinstance(files, str) else [Path(file) for file in files]
