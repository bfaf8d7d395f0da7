"""Checks a study's config, and says what is wrong so that it can be put right."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import resources
from itertools import islice
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from jsonschema.validators import extend

from biogrip.errors import BiogripError, nearest
from biogrip.experiment.sample import MODELS, MOST_BRANCHES
from biogrip.identify.methods import METHODS
from biogrip.study.meaning import Problem, arm_problems, meaning_problems, workflow_problems
from biogrip.study.source import ConfigFiles, KeyPath, dotted, overlaid
from biogrip.study.sweeps import placed, point_blocks, sweep_problems
from biogrip.study.yaml_text import LONGEST_NUMBER
from biogrip.traces.recordings import nearest_unit

OVERRIDABLE = (
    *("gripper", "protocol", "measurement", "search_range"),
    *("genetic_algorithm", "genetic_refined", "least_squares", "differential_evolution"),
    *("models", "calibration", "identifiability"),
)
"""Blocks that hold for all cases, and that a case may change for itself."""

# YAML 1.1 reads 1e-3 as text, for want of a dot; people mean a number.
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+")
_PROSE = {"title", "error_percent", "label", "unit"}
_SHOWN = 6
_EXPLAINED = 1000
_MOST_COUNTED = 2**53
_UNITS = (("time_unit",), ("rotation_unit",))


def _unless_longer(keyword: str, most: str) -> Any:
    """Return jsonschema's check of a keyword, left out where there is more than allowed anyway.

    It takes seconds for tens of thousands of items, for unequal ones the square of them.
    """
    whole = Draft202012Validator.VALIDATORS[keyword]

    def check(
        validator: Any, value: Any, instance: Any, leaf: Mapping[str, Any]
    ) -> Iterator[ValidationError]:
        long = isinstance(instance, list | dict) and len(instance) > leaf.get(most, math.inf)
        if not long:
            yield from whole(validator, value, instance, leaf)

    return check


_Validator = extend(
    Draft202012Validator,
    validators={
        "items": _unless_longer("items", "maxItems"),
        "uniqueItems": _unless_longer("uniqueItems", "maxItems"),
        "additionalProperties": _unless_longer("additionalProperties", "maxProperties"),
    },
    type_checker=Draft202012Validator.TYPE_CHECKER.redefine(
        "integer",
        lambda _, value: isinstance(value, int) and not isinstance(value, bool),
    ),
)


@cache
def schema() -> dict[str, Any]:
    """Return the JSON Schema of a study, with the sample models and methods that there are."""
    text = resources.files("biogrip.study").joinpath("schema.yaml").read_text(encoding="utf-8")
    loaded: dict[str, Any] = yaml.safe_load(text)
    sample = loaded["$defs"]["sample"]["properties"]
    sample["model"]["enum"] = list(MODELS)
    sample["branches"]["maximum"] = MOST_BRANCHES
    loaded["properties"]["methods"]["items"]["enum"] = list(METHODS)
    selection = loaded["properties"]["model_selection"]["properties"]
    selection["models"]["items"]["enum"] = list(MODELS)
    return loaded


def with_numbers(value: Any) -> Any:
    """Return a copy of a config in which text like ``1e-3`` has become a number."""
    if isinstance(value, Mapping):
        return {k: v if k in _PROSE else with_numbers(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [with_numbers(item) for item in value]
    if isinstance(value, str) and len(value) <= LONGEST_NUMBER and _NUMBER.fullmatch(value.strip()):
        number = float(value)
        # Beyond, a float does not hold every whole number, nor would anybody count them.
        whole = number.is_integer() and abs(number) < _MOST_COUNTED
        return int(number) if whole else number
    return value


def check(config: Mapping[str, Any], files: ConfigFiles, *, for_workflow: bool = True) -> None:
    """Check a complete config, in which every case has its blocks filled in.

    Parameters
    ----------
    config, files
        The config, and where its keys stand.
    for_workflow
        Whether it is to be run by the workflow, which names of files must suit.

    Raises
    ------
    BiogripError
        Names file, line and key of every problem (the first few, where there
        are many), what was found and what is allowed.
    """
    problems = (
        list(_odd_keys((), config))
        or _case_problems(config)
        or list(sweep_problems(config))
        or list(_point_problems(config))
        or (list(workflow_problems(config)) if for_workflow else [])
    )
    seen: dict[str, str] = {}
    for path, text in problems:
        # A block that a case inherits is wrong once, not once a case.
        place = files.place(_origin(path, files))
        seen.setdefault(f"{place}: {dotted(_origin(path, files))}: {text}", place)
    if seen:
        shown = list(islice(seen, _SHOWN))
        if len(seen) > _SHOWN:
            more = "or more" if len(seen) >= _EXPLAINED else "more"
            shown.append(f"... and {len(seen) - _SHOWN} {more}.")
        raise BiogripError("The study's configuration cannot be used.\n" + "\n".join(shown))


def _origin(path: KeyPath, files: ConfigFiles) -> KeyPath:
    """Path of the study-wide key that a case inherits, or the path itself."""
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


def _schema_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    # No comparison with a bound tells that a NaN is beyond it.
    odd = list(_not_finite((), config))
    yield from odd or _explained(_Validator(schema()).iter_errors(config))


def _explained(errors: Iterable[ValidationError], path: KeyPath = ()) -> Iterator[Problem]:
    """Explain errors in the order of their paths, which start at `path`."""
    ordered = sorted(errors, key=lambda error: [str(part) for part in error.absolute_path])
    explained = (
        problem for error in ordered for problem in _explain((*path, *error.absolute_path), error)
    )
    yield from islice(explained, _EXPLAINED)


def _assumed_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Check the grippers that identifications believe in like the true ones."""
    validator = _Validator({"$ref": "#/$defs/gripper", "$defs": schema()["$defs"]})
    for name, case in config["cases"].items():
        assumed = case.get("assumed_gripper")
        if isinstance(assumed, Mapping):
            path, believed = ("cases", name, "assumed_gripper"), overlaid(case["gripper"], assumed)
            odd = list(_explained(validator.iter_errors(believed), path))
            yield from odd or arm_problems(path, believed)


def value_problem(key: KeyPath, value: Any) -> str | None:
    """Say what is wrong with the value of a key, looked at alone, if anything is.

    Parameters
    ----------
    key
        Its path in the schema, blocks by name, e.g. ``("measurement", "noise_rad")``.
    value
        What it would be.
    """
    leaf = {"properties": schema()["properties"]}
    for part in key:
        leaf = leaf["properties"][part]
        leaf = schema()["$defs"][leaf["$ref"].rpartition("/")[2]] if "$ref" in leaf else leaf
    problems = [*_not_finite(key, value), *_explained(_Validator(leaf).iter_errors(value), key)]
    return problems[0][1] if problems else None


def _point_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Check every point of every sweep like a case that the user wrote."""
    points = point_blocks(config)
    if points:
        whole = {**config, "cases": points}
        yield from (placed(config, problem) for problem in _case_problems(whole))


def _case_problems(config: Mapping[str, Any]) -> list[Problem]:
    return (
        list(_schema_problems(config))
        or list(meaning_problems(config))
        or list(_assumed_problems(config))
    )


def _explain(path: KeyPath, error: ValidationError) -> Iterator[Problem]:
    found = error.instance
    limit = error.validator_value
    match error.validator:
        case "additionalProperties":
            allowed = list(error.schema["properties"])
            unknown = [key for key in found if key not in allowed]
            for index, key in enumerate(unknown):
                hint = nearest(key, allowed) if index < _SHOWN else ""
                yield (*path, key), f"unknown key.{hint} Allowed here: {', '.join(allowed)}."
        case "required":
            missing = next(key for key in limit if f"'{key}'" in error.message)
            yield (*path, missing), "is missing and has no default."
        case "pattern":
            allowed = error.schema["allowed"]
            if "type" in error.schema:
                yield path, f"found {_shown(found)}, allowed is {allowed}."
            else:
                kind = str(path[-1]).removesuffix("s")
                yield (*path, found), f"not a usable {kind} name: {allowed} (it names files)."
        case "type":
            words = {
                "object": "a block of keys",
                "array": "a list",
                "string": "text",
                "boolean": "true or false",
            }
            kinds = [limit] if isinstance(limit, str) else limit
            article = "an" if limit == "integer" else "a"
            wanted = " or ".join(words.get(kind, f"{article} {kind}") for kind in kinds)
            yield path, f"found {_shown(found)}, allowed is {wanted}."
        case "enum":
            hint = nearest_unit(found, limit) if path[-1:] in _UNITS else nearest(found, limit)
            yield (
                path,
                f"found {_shown(found)}.{hint} Allowed: {', '.join(map(str, limit))}.",
            )
        case "minItems" | "maxItems":
            word = "at least" if error.validator == "minItems" else "at most"
            yield path, f"found a list of {len(found)}, allowed are {word} {limit} items."
        case "minLength" | "maxLength":
            word = "at least" if error.validator == "minLength" else "at most"
            text = f"found {_shown(found)} of {len(found)} characters, allowed are {word} {limit}."
            yield path, text
        case "maxProperties":
            yield path, f"found {len(found)} keys, allowed are at most {limit}."
        case "uniqueItems":
            yield path, "holds something twice; allowed is every item once."
        case "minProperties":
            yield path, "is empty; at least one is needed."
        case _:
            yield path, f"found {_shown(found)}, allowed is {_range(error.schema)}."


def _range(leaf: Mapping[str, Any]) -> str:
    bounds = {
        "exclusiveMinimum": "greater than",
        "minimum": "at least",
        "exclusiveMaximum": "less than",
        "maximum": "at most",
    }
    unit = f" {leaf['unit']}" if "unit" in leaf else ""
    limits = [f"{word} {bound(leaf[key])}" for key, word in bounds.items() if key in leaf]
    return " and ".join(limits) + unit


def bound(limit: float) -> str:
    """Return a limit as people write it, whole numbers in full."""
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _shown(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Mapping):
        return "a block of keys"
    if isinstance(value, list):
        return "a list"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _not_finite(path: KeyPath, value: Any) -> Iterator[Problem]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _not_finite((*path, key), inner)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _not_finite((*path, index), inner)
    elif isinstance(value, float) and not math.isfinite(value):
        yield path, f"found {value}, allowed is a finite number."
