"""Validation of a study's config, with messages that name file, line and key."""

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from biogrip.errors import BiogripError
from biogrip.instrument.gripper import Gripper
from biogrip.keys import Key, Problem
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.messages import MOST_EXPLAINED, shape_at, value_problems
from biogrip.study.readings import read_blocks
from biogrip.study.source import ConfigFiles, KeyPath, dotted, overlaid
from biogrip.study.sweep_checks import placed, sweep_problems
from biogrip.study.sweeps import list_points, make_sweeps, point_blocks
from biogrip.study.typed import Shape, built, parts, plain

STUDY = Shape(Key(), block=StudyConfig)
"""Schema of a whole config."""

_CASE = Shape(Key(), block=CaseBlock)
_GRIPPER = Shape(Key(), block=Gripper)
_SCALARS = (float, int, str, type(None))
_SHOWN = 6


def checked(
    config: Mapping[str, Any], files: ConfigFiles, *, for_workflow: bool = True
) -> StudyConfig:
    """Validate a complete config and convert it to dataclasses; cases must have all blocks.

    Parameters
    ----------
    config, files
        The merged config, and the line numbers of its keys.
    for_workflow
        If true, refuse paths of traces that Snakemake would read as wildcards.

    Raises
    ------
    BiogripError
        Names file, line and key of the first few problems, with what was found and what is allowed.
    """
    _refuse(_odd_keys((), config), files)
    _refuse(_plain_problems(config), files)
    study = built(StudyConfig, config)
    _refuse(block_problems((), study), files)
    study = study.chosen
    _refuse(_assumed_problems(study.cases), files)
    _refuse(sweep_problems(study.sweeps, study.cases), files)
    _refuse(_point_problems(study), files)
    _refuse(_reading_problems(study), files)
    if for_workflow:
        _refuse(_workflow_problems(study.cases), files)
    return study


def value_problem(key: tuple[str, ...], value: Any) -> str | None:
    """Return what is wrong with a single key's value, or None.

    Parameters
    ----------
    key
        Path of the key, blocks by name, e.g. ``("measurement", "noise_rad")``.
    value
        Plain value.
    """
    return next((text for _, text in value_problems(shape_at(STUDY, key), value)), None)


def block_problems(path: KeyPath, value: Any) -> Iterator[Problem]:
    """Find conflicts between keys, in blocks whose single values are valid."""
    inside = [
        problem
        for part, inner in parts(value)
        if not isinstance(inner, _SCALARS)
        for problem in block_problems((*path, part), inner)
    ]
    yield from inside
    if not inside and hasattr(value, "problems"):
        for place, text in value.problems():
            yield (*path, *place), text


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
            if any(candidate in lines for _, lines in files.lines):
                return path if candidate == path[:length] else path[2:]
    return path[2:]


def _odd_keys(path: KeyPath, value: Any) -> Iterator[Problem]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not isinstance(key, str):
                text = "is no text: YAML reads on, off, yes, no and numbers otherwise; put it in"
                yield (*path, key), f"{text} quotes."
            yield from _odd_keys((*path, key), inner)


def _plain_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    for path, text in value_problems(STUDY, config):
        # Skip inherited blocks that are invalid: the problem is reported for the study's block.
        inherited = len(path) == 3 and path[0] == "cases" and path[2] in OVERRIDABLE
        if not (inherited and path[2] not in config["cases"][path[1]]):
            yield path, text


def _assumed_problems(cases: Mapping[str, CaseBlock]) -> Iterator[Problem]:
    """Check the grippers assumed by identifications like true grippers."""
    for name, case in cases.items():
        if isinstance(case.assumed_gripper, Mapping):
            path = ("cases", name, "assumed_gripper")
            believed = overlaid(plain(case.gripper.neutral), case.assumed_gripper)
            odd = list(value_problems(_GRIPPER, believed))
            yield from (((*path, *place), text) for place, text in odd)
            if not odd:
                yield from block_problems(path, built(Gripper, believed))


def _point_problems(study: StudyConfig) -> Iterator[Problem]:
    """Check every point of every sweep as if it were a case of the config."""
    sweeps = make_sweeps(study.sweeps)
    by_name = {point.name: (sweep, point) for sweep, point in list_points(sweeps)}
    for name, block in point_blocks(sweeps, study.cases).items():
        path = ("cases", name)
        found = [((*path, *place), text) for place, text in value_problems(_CASE, block)]
        if not found:
            case = built(CaseBlock, block)
            found = list(block_problems(path, case))
            found = found or list(_assumed_problems({name: case}))
            contact = case.contact_problems(study.actuator)
            found = found or [((*path, *place), text) for place, text in contact]
        yield from (placed(by_name, problem) for problem in found)


def _reading_problems(study: StudyConfig) -> Iterator[Problem]:
    """Check every case under every reading as if it were a case of the config."""
    for reading, _, block in read_blocks(study.readings, study.cases):
        path = ("readings", reading, "changes")
        found = [((*path, *place), text) for place, text in value_problems(_CASE, block)]
        yield from found or block_problems(path, built(CaseBlock, block))


def _workflow_problems(cases: Mapping[str, CaseBlock]) -> Iterator[Problem]:
    """Find paths of traces that Snakemake would read as wildcards."""
    for name, case in cases.items():
        file = case.measurement.file or ""
        if any(bracket in file for bracket in "{}<>"):
            text = f"found '{file}', allowed is a name without {{ }} < >: Snakemake fills them in."
            yield ("cases", name, "measurement", "file"), text
