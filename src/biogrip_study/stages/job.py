"""What a job is told: some keys of the config, the seeds of its batch, and its files.

A rule's ``params`` are some keys of the config as plain values, those of its case laid over the
study's (`settings`). Its script makes a `Case` or a `Study` of these again (`case_with_keys`,
`study_of`), in which every other key is an error: a rule that forgets to name one fails, and
cannot give a result that Snakemake would not renew. Each job has a batch of the case's seeds
(`batch_names`), calls functions with its files (`arguments`), and writes what it says to its log
(`logged`).
"""

import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr
from dataclasses import MISSING, Field, fields
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import Any, ClassVar, get_type_hints

from biogrip.errors import BiogripError
from biogrip.keys import built
from biogrip.terminal import collect_less
from biogrip.traces.measurement_block import MeasurementBlock
from biogrip_study.config.study import Case, Study
from biogrip_study.config.study_blocks import CaseBlock, Identifiability, StudyConfig
from biogrip_study.records.rows import seeds_of

STUDY_KEYS = tuple(field.name for field in fields(StudyConfig))
"""All keys of a study."""
CASE_KEYS = tuple(field.name for field in fields(CaseBlock))
"""All keys of a case."""


class _Named:
    """A config block with the keys that a rule names; to read another one is an error."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init__(self, keys: Mapping[str, Any]) -> None:
        vars(self).update(keys)

    def __getattribute__(self, name: str) -> Any:
        """Return a key, or what the block makes of its keys; not the default of another key."""
        if name in type(self).__dataclass_fields__ and name not in vars(self):
            raise AttributeError(f"{name} is not among the keys that the rule names.")
        return super().__getattribute__(name)


# Blocks of which a rule may name single keys.
_SPLIT = {"measurement": MeasurementBlock, "identifiability": Identifiability}


def settings(study: Study, keys: Iterable[str], case: str = "") -> dict[str, Any]:
    """Return some keys of a study, or of a case or a point of a sweep, plain; None for a default.

    Keys name blocks, or single keys in a block, e.g. ``measurement.noise``; or ``cases.NAME.KEY``
    for a key of a case with the study's blocks merged in.
    """
    blocks = study.plain
    if case:
        # What the case leaves at its default is not the study's: it has all of its blocks.
        blocks = {key: value for key, value in blocks.items() if key not in CASE_KEYS}
        blocks |= study.case(case).plain | {"seeds": study.case(case).seeds}
    blocks = blocks | {"cases": {name: of.plain for name, of in study.cases.items()}}

    def value_of(key: str) -> Any:
        value: Any = blocks
        for name in key.split("."):
            value = (value or {}).get(name)
        return value

    return {key: value_of(key) for key in keys}


def keys_of_cases(study: Study, *keys: str) -> list[str]:
    """Return keys of every case, as ``cases.NAME.KEY``."""
    return [f"cases.{name}.{key}" for name in study.cases for key in keys]


def case_with_keys(name: str, given: Mapping[str, Any], calibrated: Iterable[Path] = ()) -> Case:
    """Return a case of which some keys are given, by `settings`, and the file of its gripper."""
    study = Study(_named(StudyConfig, given), calibrations={file.stem: file for file in calibrated})
    return Case(name, _named(CaseBlock, given), study.config, study=study)


def study_of(given: Mapping[str, Any], calibrated: Iterable[Path] = ()) -> Study:
    """Return a study of which, and of whose cases, some keys are given, by `settings`.

    Calibrated grippers are named like their cases.
    """
    cases: dict[str, dict[str, Any]] = {}
    for key, value in given.items():
        if key.startswith("cases."):
            _, name, inner = key.split(".", 2)
            cases.setdefault(name, {})[inner] = value
    blocks = {name: _named(CaseBlock, keys) for name, keys in cases.items()}
    named = _named(StudyConfig, given, cases=blocks)
    return Study(named, calibrations={file.stem: file for file in calibrated})


def _named(kind: Any, given: Mapping[str, Any], **keys: Any) -> Any:
    """Return a block with those of the keys given that it has; None stands for their default."""
    hints = get_type_hints(kind, include_extras=True)
    for field in fields(kind):
        above = f"{field.name}."
        inner = {key.removeprefix(above): given[key] for key in given if key.startswith(above)}
        if inner and field.name in _SPLIT:
            keys[field.name] = _named(_SPLIT[field.name], inner)
        elif given.get(field.name) is not None:
            keys[field.name] = built(hints[field.name], given[field.name])
        elif field.name in given:
            made = field.default_factory
            keys[field.name] = field.default if made is MISSING else made()
    return type(kind.__name__, (_Named, kind), {})(keys)


def batch_names(seeds: int, size: int) -> list[str]:
    """Return the names of the batches of a case, cut at multiples of their size."""
    starts = range(0, seeds, size)
    return [f"seeds_{first}-{min(first + size, seeds) - 1}" for first in starts]


@contextmanager
def logged(job: Any) -> Iterator[None]:
    """Write what is said to the job's log; an error of ours ends it with its message alone."""
    collect_less()
    with Path(job.log[0]).open("w", encoding="utf-8") as stream, redirect_stderr(stream):
        try:
            yield
        except BiogripError as error:
            print(f"biogrip: {error}", file=stream)
            raise SystemExit(1) from error
        except Exception:
            traceback.print_exc(file=stream)
            raise


def job_study(job: Any) -> Study:
    """Return the study of a job, with the keys and the calibrated grippers that its rule names."""
    return study_of(job_settings(job), paths(job.input.get("calibrated", [])))


def job_settings(job: Any) -> dict[str, Any]:
    """Return the keys of the config that a job's rule names, as plain values."""
    blocks = [param for param in job.params if isinstance(param, dict)]
    given = {key: value for block in blocks for key, value in block.items()}
    del given["software"]
    return given


def called(stage: str, job: Any) -> Any:
    """Call the function of a full name with what it takes of a job, see `arguments`."""
    module, _, name = stage.rpartition(".")
    function = getattr(import_module(module), name)
    return function(**arguments(job, function))


def arguments(job: Any, function: Callable[..., object]) -> dict[str, Any]:
    """Return what a function takes: params, wildcards and files of a job's rule, by their names.

    ``case`` is the case, ``study`` the study, and ``seeds`` are those of the batch. Files of
    calibrated grippers, the input ``calibrated``, are told to the cases that they are named like.
    """
    of_job = job.params, job.wildcards, job.input, job.output
    given: dict[str, Any] = {name: value for of in of_job for name, value in of.items()}
    given["seeds"] = [*seeds_of(given.get("batch", "seeds_0-0"))]
    for name, kind in get_type_hints(function).items():
        if kind is Case:
            calibrated = paths(job.input.get("calibrated", []))
            given[name] = case_with_keys(job.wildcards.case, job_settings(job), calibrated)
        elif kind is Study:
            given[name] = job_study(job)
        elif kind is Path:
            (given[name],) = paths(given[name])
        elif kind == list[Path]:
            given[name] = paths(given[name])
    return {name: given[name] for name in signature(function).parameters}


def paths(files: Any) -> list[Path]:
    """Return files of Snakemake as paths; one file is a list of one."""
    return [Path(files)] if isinstance(files, str | Path) else [Path(file) for file in files]
