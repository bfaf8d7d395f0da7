"""Validation of a study's config, with messages that name file, line and key."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any, TypeVar

from biogrip.errors import BiogripError
from biogrip.fit.methods import block_class
from biogrip.instrument.gripper import Gripper
from biogrip.keys import Problem
from biogrip.study.case_blocks import METHOD_BLOCKS, OVERRIDABLE, CaseBlock, Shared
from biogrip.study.config import StudyConfig
from biogrip.study.interpretations import read_blocks
from biogrip.study.measurement_block import MeasurementBlock
from biogrip.study.messages import MISSING, MOST_EXPLAINED, checked, inside, unknown
from biogrip.study.plain import plain
from biogrip.study.source import ConfigFiles, KeyPath, dotted, overlaid
from biogrip.study.sweep_checks import placed, sweep_problems
from biogrip.study.sweeps import list_points, point_blocks

T = TypeVar("T", bound=Shared)
_SHOWN = 6
_SURROGATE = re.compile("[\ud800-\udfff]")


def checked_study(
    config: Mapping[str, Any], files: ConfigFiles, *, for_workflow: bool = True
) -> StudyConfig:
    """Validate a complete config and build its blocks; cases must have all blocks.

    For a workflow, paths of traces are refused that Snakemake would read as wildcards.

    Raises
    ------
    BiogripError
        Names file, line and key of the first few problems, with what was found and what is allowed.
    """
    _refuse(_unwritable((), config), files)
    study, problems = _with_methods(StudyConfig, config)
    _refuse(_own_problems(config, problems), files)
    assert study is not None
    study = study.chosen
    _refuse(_assumed_problems(study.cases), files)
    _refuse(sweep_problems(study.sweeps, study.cases), files)
    _refuse(_point_problems(study), files)
    _refuse(_reading_problems(study), files)
    if for_workflow:
        _refuse(_workflow_problems(study), files)
    return study


def measurement_problem(key: str, value: Any) -> str | None:
    """Return what is wrong with the value of a single key of a measurement, or None."""
    found = [*_unwritable((key,), value)] or checked(MeasurementBlock, {key: value})[1]
    return next((text for path, text in found if path == (key,)), None)


def some_case_problems(block: Mapping[str, Any]) -> list[Problem]:
    """Return what is wrong in some blocks of a case, whatever the case lacks."""
    found = [*_unwritable((), block)] or _with_methods(CaseBlock, block)[1]
    return [(path, text) for path, text in found if text != MISSING]


def _with_methods(kind: type[T], block: Any) -> tuple[T | None, list[Problem]]:
    """Build a config block, or find what is not allowed in it and in the blocks of methods."""
    built, problems = checked(kind, block)
    problems += _method_problems((), kind, block)
    cases = block.get("cases")
    for name, case in cases.items() if isinstance(cases, Mapping) else ():
        if isinstance(case, Mapping):
            problems += _method_problems(("cases", name), CaseBlock, case)
    return built, problems


def _method_problems(path: KeyPath, kind: type[Shared], block: Mapping[str, Any]) -> list[Problem]:
    allowed = [*kind.model_fields, *METHOD_BLOCKS]
    found: list[Problem] = [
        ((*path, name), unknown((*path, name), allowed)) for name in block if name not in allowed
    ]
    for name in METHOD_BLOCKS:
        problems = checked(block_class(name), block.get(name, {}))[1]
        if problems and name not in block:
            problems = [((), MISSING)]
        found += [((*path, name, *place), text) for place, text in problems]
    return found


def _refuse(problems: Iterator[Problem], files: ConfigFiles) -> None:
    """Raise an error that lists the first few problems, if there are any."""
    found_before: dict[str, None] = {}
    for path, text in islice(problems, MOST_EXPLAINED):
        # A problem in a block that cases inherit is reported once, not once per case.
        origin = _origin(path, files)
        found_before[f"{files.place(origin)}: {dotted(origin)}: {text}"] = None
    if found_before:
        shown = list(islice(found_before, _SHOWN))
        if len(found_before) > _SHOWN:
            more = "or more" if len(found_before) >= MOST_EXPLAINED else "more"
            shown.append(f"... and {len(found_before) - _SHOWN} {more}.")
        raise BiogripError("The study's configuration cannot be used.\n" + "\n".join(shown))


def _origin(path: KeyPath, files: ConfigFiles) -> KeyPath:
    """Return the path of the study-wide key that a case inherits, or the path itself."""
    if len(path) < 3 or path[0] != "cases" or path[2] not in OVERRIDABLE:
        return path
    for length in range(len(path), 2, -1):
        for candidate in (path[:length], path[2:length]):
            if any(candidate in lines for _, lines in (*files.lines, *files.over)):
                return path if candidate == path[:length] else path[2:]
    return path[2:]


def _unwritable(path: KeyPath, value: Any) -> Iterator[Problem]:
    """Find what JSON does not have: keys that are no text, numbers that are not finite."""
    if isinstance(value, float) and not math.isfinite(value):
        yield path, f"found {value}, allowed is a finite number."
    if isinstance(value, str) and _SURROGATE.search(value):
        yield path, "holds half a character, allowed is text."
    for key, inner in inside(value):
        if isinstance(value, Mapping) and not isinstance(key, str):
            text = "is no text: YAML reads on, off, yes, no and numbers otherwise; put it in"
            yield (*path, key), f"{text} quotes."
        yield from _unwritable((*path, key), inner)


def _own_problems(config: Mapping[str, Any], problems: Iterable[Problem]) -> Iterator[Problem]:
    """Leave out blocks that a case inherits and that are none: the study's has the problem."""
    for path, text in problems:
        inherited = len(path) == 3 and path[0] == "cases" and path[2] in OVERRIDABLE
        if not (inherited and path[2] not in config["cases"][path[1]]):
            yield path, text


def _assumed_problems(cases: Mapping[str, CaseBlock]) -> Iterator[Problem]:
    """Check the grippers assumed by identifications like true grippers."""
    for name, case in cases.items():
        if isinstance(case.assumed_gripper, Mapping):
            believed = overlaid(plain(case.gripper.neutral), case.assumed_gripper)
            for path, text in checked(Gripper, believed)[1]:
                yield ("cases", name, "assumed_gripper", *path), text


def _point_problems(study: StudyConfig) -> Iterator[Problem]:
    """Check every point of every sweep as if it were a case of the config."""
    by_name = {point.name: (sweep, point) for sweep, point in list_points(study.sweeps)}
    for name, block in point_blocks(study.sweeps, study.cases).items():
        case, found = _with_methods(CaseBlock, block)
        if case and not found:
            found = list(case.comb_problems(study.actuator))
            found += [(path[2:], text) for path, text in _assumed_problems({name: case})]
        yield from (
            placed(study.sweeps, by_name, (("cases", name, *path), text)) for path, text in found
        )


def _reading_problems(study: StudyConfig) -> Iterator[Problem]:
    """Check every case under every reading as if it were a case of the config."""
    for interpretation, _, block in read_blocks(study.interpretations, study.cases):
        for path, text in _with_methods(CaseBlock, block)[1]:
            yield ("interpretations", interpretation, "changes", *path), text


def brackets_problem(file: str) -> str | None:
    """Return what is wrong with the path of a trace that Snakemake would read as wildcards."""
    if any(bracket in file for bracket in "{}<>"):
        return f"found '{file}', allowed is a name without {{ }} < >: Snakemake fills them in."
    return None


def _workflow_problems(study: StudyConfig) -> Iterator[Problem]:
    """Find paths of traces that Snakemake would read as wildcards."""
    for key in ("table", "config") if study.traces else ():
        if problem := brackets_problem(getattr(study.traces, key) or ""):
            yield ("traces", key), problem
    for name, case in study.cases.items():
        if problem := brackets_problem(case.measurement.file or ""):
            yield ("cases", name, "measurement", "file"), problem
