"""Checks a study's config, and says what is wrong so that it can be put right."""

import math
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from itertools import islice
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from jsonschema.validators import extend

from biogrip.errors import BiogripError, nearest
from biogrip.identify.methods import METHODS
from biogrip.sample import MODELS, MOST_BRANCHES
from biogrip.study.meaning import Problem, meaning_problems
from biogrip.study.source import ConfigFiles, KeyPath
from biogrip.study.sweeps import placed, point_blocks, sweep_problems

OVERRIDABLE = (
    *("gripper", "protocol", "measurement", "search_range"),
    *("genetic_algorithm", "genetic_refined", "least_squares", "differential_evolution"),
    *("models", "calibration", "identifiability"),
)
"""Blocks that hold for all cases, and that a case may change for itself."""

# YAML 1.1 reads 1e-3 as text, for want of a dot; people mean a number.
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")
_PROSE = {"title", "error_percent", "label", "unit"}
_SHOWN = 6

_Validator = extend(
    Draft202012Validator,
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
    if isinstance(value, str) and _NUMBER.fullmatch(value.strip()):
        number = float(value)
        return int(number) if number.is_integer() else number
    return value


def check(config: Mapping[str, Any], files: ConfigFiles) -> None:
    """Check a complete config, in which every case has its blocks filled in.

    Raises
    ------
    BiogripError
        Names file, line and key of every problem (the first few, where there
        are many), what was found and what is allowed.
    """
    problems = (
        list(_odd_keys((), config))
        or list(_schema_problems(config))
        or list(meaning_problems(config))
        or list(sweep_problems(config))
        or list(_point_problems(config))
    )
    seen: dict[str, str] = {}
    for path, text in problems:
        # A block that a case inherits is wrong once, not once a case.
        place = files.place(_origin(path, files))
        seen.setdefault(f"{place}: {_dotted(_origin(path, files))}: {text}", place)
    if seen:
        shown = list(islice(seen, _SHOWN))
        if len(seen) > _SHOWN:
            shown.append(f"... and {len(seen) - _SHOWN} more.")
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


def _dotted(path: KeyPath) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text or "the file"


def _odd_keys(path: KeyPath, value: Any) -> Iterator[Problem]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not isinstance(key, str):
                text = "is no text: YAML reads on, off, yes, no and numbers otherwise; put it in"
                yield (*path, key), f"{text} quotes."
            yield from _odd_keys((*path, key), inner)


def _schema_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    errors = _Validator(schema()).iter_errors(config)
    for error in sorted(errors, key=lambda error: [str(part) for part in error.absolute_path]):
        yield from _explain(tuple(error.absolute_path), error)
    yield from _not_finite((), config)


def _point_problems(config: Mapping[str, Any]) -> Iterator[Problem]:
    """Check every point of every sweep like a case that the user wrote."""
    points = point_blocks(config)
    if points:
        whole = {**config, "cases": points}
        found = list(_schema_problems(whole)) or list(meaning_problems(whole))
        yield from (placed(config, problem) for problem in found)


def _explain(path: KeyPath, error: ValidationError) -> Iterator[Problem]:
    found = error.instance
    limit = error.validator_value
    match error.validator:
        case "additionalProperties":
            allowed = list(error.schema["properties"])
            for key in found:
                if key not in allowed:
                    hint = nearest(key, allowed)
                    yield (
                        (*path, key),
                        f"unknown key.{hint} Allowed here: {', '.join(allowed)}.",
                    )
        case "required":
            missing = next(key for key in limit if f"'{key}'" in error.message)
            yield (*path, missing), "is missing and has no default."
        case "propertyNames" | "pattern":
            if path[-1:] and path[-1] in _PROSE:
                text = "allowed are 1 to 60 letters, digits, spaces and . , : ; ( ) + / % ' - _."
                yield path, f"found {_shown(found)}, {text}"
            else:
                kind, rest = {
                    "cases": ("case", "63 letters, digits, '_' or '-'"),
                    "sweeps": ("sweep", "31 letters, digits or '_'"),
                }[str(path[0])]
                text = f"a letter, then up to {rest} (it names files)."
                yield (*path, found), f"not a usable {kind} name: {text}"
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
            hint = nearest(found, limit)
            yield (
                path,
                f"found {_shown(found)}.{hint} Allowed: {', '.join(map(str, limit))}.",
            )
        case "minItems" | "maxItems":
            bound = "at least" if error.validator == "minItems" else "at most"
            yield (
                path,
                f"found a list of {len(found)}, allowed are {bound} {limit} items.",
            )
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
    return " and ".join(f"{word} {leaf[key]}" for key, word in bounds.items() if key in leaf) + unit


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
