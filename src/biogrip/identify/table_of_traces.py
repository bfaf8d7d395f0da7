"""Tables of recorded traces: a row a trace, with settings of its own and words to be copied.

The column `file` makes a table. A column whose name has a dot, as `measurement.noise_rad`, is a key
of the config, and its cells are values for the traces of their rows; an empty cell leaves the key
as the config and the options have it. All other columns are copied to the results.
"""

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from biogrip.errors import BiogripError, nearest
from biogrip.identify.many_traces import COLUMNS
from biogrip.identify.one_trace import IdentifyOptions, study_of
from biogrip.physics.models import MODELS
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.messages import Schema, checked, schema_of
from biogrip.study.source import overlaid, scalar_problem
from biogrip.study.study import Case
from biogrip.terminal import visible
from biogrip.traces.columns import listed, place
from biogrip.traces.tables import SEPARATORS

FILE = "file"
"""The column that every table has."""

_BLOCKS = ("sample", "gripper", "protocol", "measurement", "search_range", "models", "fixed")
# Keys of simulated traces, and the one that the column of files says.
_LEFT_OUT = ("measurement.file", "measurement.rate_Hz", "measurement.noise", "models.target")
_OF_RESULTS = re.compile(r".* (verdict|value|low|high)( \(.*\))?")
_MOST_SHOWN = 10
_HEAD_BYTES = 100_000


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Parameters
    ----------
    line
        Its line in the file, from 1.
    file
        File of the trace.
    settings
        Blocks of a config with the values of this trace.
    copied
        Cells of the other columns by name.
    """

    line: int
    file: Path
    settings: Mapping[str, Any]
    copied: Mapping[str, str]


def is_table(path: Path) -> bool:
    """Return True if the first line of a file is a header with a column `file`."""
    with path.open("rb") as stream:
        first = stream.readline(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    # Another spelling, as File, is a table, too, whose reader says what is wrong.
    return any(
        name.strip('" \r\n').lower() == FILE for each in SEPARATORS for name in first.split(each)
    )


def read_table(path: Path) -> list[Row]:
    """Read a table, and check all of it but the traces.

    Parameters
    ----------
    path
        Text in UTF-8 with a header: `.tsv` is separated by tabs, another by what its header has.

    Raises
    ------
    BiogripError
        With line and column of the first few problems: text that is no table, unknown keys, values
        that are not allowed, a trace twice.
    """
    cells = _cells(path)
    header, rows = cells[0], [(line, row) for line, row in enumerate(cells[1:], 2) if any(row)]
    if FILE not in header:
        raise BiogripError(
            f"{place(path, 1)}: found no column '{FILE}' among {listed(header)}; allowed is one."
            f"{nearest(FILE, header)}"
        )
    if not rows:
        raise BiogripError(f"{place(path)}: found no traces, allowed is a row for each.")
    problems = list(_name_problems(path, header))
    settings = {name: keys()[name] for name in header if name in keys()}
    found, lines = [], dict[str, int]()
    for line, row in rows:
        by_name = dict(zip(header, row, strict=True))
        file, own = path.parent / by_name[FILE], dict[str, Any]()
        # Resolved, so that links to one file are found.
        before = lines.setdefault(os.path.realpath(file), line)
        if not by_name[FILE]:
            problems.append(f"{place(path, line, FILE)}: found nothing, allowed is a trace.")
        elif before != line:
            text = f"found '{visible(by_name[FILE])}' again, as on line {before}; allowed is each"
            problems.append(f"{place(path, line, FILE)}: {text} trace once.")
        for name, schema in settings.items():
            if by_name[name]:
                value, problem = _value(name, schema, by_name[name])
                own = overlaid(own, value)
                problems += [f"{place(path, line, name)}: {problem}"] if problem else []
        found.append(Row(line, file, own, {it: by_name[it] for it in header if _is_copied(it)}))
    if problems:
        raise BiogripError(_first(problems))
    return found


def _cells(path: Path) -> list[list[str]]:
    """Return the header and all rows as text, empty where a row is shorter."""
    # Imported here: loading pandas takes long.
    import pandas as pd

    try:
        with path.open(encoding="utf-8-sig") as stream:
            header = stream.readline()
        separator = "\t" if path.suffix == ".tsv" else max(SEPARATORS, key=header.count)
        frame = pd.read_csv(
            path,
            sep=separator,
            header=None,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
            skipinitialspace=True,
            encoding="utf-8-sig",
        )
    except (OSError, ValueError) as error:
        found = " ".join(str(error).split())
        raise BiogripError(f"{place(path)}: cannot be read as a table: {found}.") from error
    return [[str(cell).strip() for cell in row] for row in frame.fillna("").to_numpy()]


def _name_problems(path: Path, header: Sequence[str]) -> Iterator[str]:
    """Find names that stand twice, are no keys, or would be taken for results."""
    for number, name in enumerate(header):
        problem = ""
        if name and name in header[:number]:
            problem = "stands twice; allowed is each name once."
        elif name in COLUMNS or _OF_RESULTS.fullmatch(name):
            problem = "is a column of the results; allowed is another name."
        elif "." in name and name not in keys():
            problem = f"is no key that a row may set.{nearest(name, keys())} A name without a dot "
            problem += "is copied."
        if problem:
            yield f"{place(path, 1, name)}: {problem}"


def _is_copied(name: str) -> bool:
    return bool(name) and name != FILE and "." not in name


@cache
def keys() -> dict[str, Schema]:
    """Return what a row may set, by the names of keys with dots."""
    case = schema_of(CaseBlock)
    found = {name: schema for block in _BLOCKS for name, schema in _leaves(block, case)}
    known = {name for model in MODELS.values() for name in model.names}
    found |= {f"fixed.{name}": case.inside("fixed").values for name in sorted(known)}
    return {
        name: schema
        for name, schema in found.items()
        if "." in name and not f"{name}.".startswith(tuple(f"{each}." for each in _LEFT_OUT))
    }


def _leaves(path: str, above: Schema) -> Iterator[tuple[str, Schema]]:
    """Yield the keys in a block that are no blocks themselves, by their names with dots."""
    schema = above.inside(path.rpartition(".")[2])
    named = schema.get("propertyNames", {}).get("enum", ())
    if not (schema.keys or named):
        yield path, schema
    for name in (*schema.keys, *named):
        yield from _leaves(f"{path}.{name}", schema)


@cache
def _value(name: str, schema: Schema, text: str) -> tuple[Any, str | None]:
    """Return the blocks that a cell stands for, read as YAML, and what is wrong with it if so."""
    path = tuple(name.split("."))
    value: Any = text
    # Where a key takes text, a cell is text.
    if "string" not in {each.get("type") for each in (schema, *schema.options)}:
        try:
            node = yaml.compose(text, yaml.SafeLoader)
            if isinstance(node, yaml.ScalarNode) and (problem := scalar_problem(node)):
                return {}, problem
            value = schema.with_numbers(yaml.safe_load(text))
        except (yaml.YAMLError, ValueError):
            value = text
    for part in reversed(path):
        value = {part: value}
    problems = [text for at, text in checked(CaseBlock, value)[1] if at[: len(path)] == path]
    return value, next(iter(problems), None)


def cases_of(traces: Sequence[IdentifyOptions]) -> list[Case]:
    """Return the case of each trace; where the settings are the same, one serves all.

    Raises
    ------
    BiogripError
        With the places of the first few problems, if options, config or rows cannot be used, or
        traces are of different quantities.
    """
    cases: dict[str, Case | None] = {}
    problems: dict[str, None] = {}
    found = []
    for options in traces:
        settings = json.dumps(options.settings, sort_keys=True)
        if settings not in cases:
            cases[settings] = None
            try:
                (cases[settings],) = study_of(options).cases.values()
            except BiogripError as error:
                # A heading that several share is said once.
                problems |= dict.fromkeys(str(error).split("\n"))
        found.append(cases[settings])
    if problems:
        raise BiogripError(_first(list(problems)))
    usable = [case for case in found if case is not None]
    read = [case.instrument.read.name for case in usable]
    for options, name in zip(traces, read, strict=True):
        if name != read[0]:
            raise BiogripError(
                f"{options.place}: found a reading of {name}, but a reading of {read[0]} of "
                f"{traces[0].place}; allowed is one quantity read for all traces of a command."
            )
    return usable


def _first(problems: Sequence[str]) -> str:
    more = len(problems) - _MOST_SHOWN
    return "\n".join([*problems[:_MOST_SHOWN], *([f"... and {more} more."] if more > 0 else [])])
