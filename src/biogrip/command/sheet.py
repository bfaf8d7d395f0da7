"""Tables of recorded traces: a row for each, with what is said of it alone.

A column that is named like an option of ``biogrip identify``, or like a key with dots, sets it;
others are copied to the results.
"""

import csv
import os
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from io import StringIO
from itertools import zip_longest
from pathlib import Path
from typing import Any

from biogrip.command.options import OPTIONS, Setting, setting_of
from biogrip.command.outputs import COLUMNS
from biogrip.command.settings import Asked, measured_keys, refuse_all
from biogrip.config.source import value_of
from biogrip.digits import counted
from biogrip.errors import BiogripError, nearest
from biogrip.physics.instruments import CONTROLLED
from biogrip.physics.models import ALIASES, CANDIDATES
from biogrip.terminal import visible
from biogrip.traces.columns import listed, number_and_unit, place, trace_file_problem
from biogrip.traces.measurement_block import READINGS

_FILES = ("file", "filename", "filepath", "path", "trace", "tracefile")
_OF_NUMBERS: tuple[str, ...] = ("hold", "ramp", "noise", "noise_share", "start", "from", "until")
_OF_WORDS: tuple[str, ...] = ("noise_model", "offset", "drift", "reading", "shape")
# Other names of what is held.
_HELD = {"held", "load", "pressure", "indentation", *(channel.name for channel in CONTROLLED)}
# Column of samples of several traces, and name of one whose traces are all that there are.
_SAMPLE, _TOGETHER = "sample", "together"
_SEPARATORS = ",;\t"
_OF_RESULTS = re.compile(r".* (verdict|value|low|high)( \(.*\))?")
_HEAD_BYTES = 100_000
# Of a table of traces at most; rows are as wide as its header.
_LONGEST, _MOST_COLUMNS, _MOST_CELLS = 20_000_000, 1000, 3_000_000


def is_table(asked: Asked) -> bool:
    """Return True if the first line of a file is a header with a column `file`, and no trace's.

    Another name of that column, as `path`, counts above the name of a file that exists.
    """
    with asked.trace.open("rb") as stream:
        lines = [stream.readline(_HEAD_BYTES).decode("utf-8-sig", "replace") for _ in range(2)]
    names, cells = (
        [cell.strip(' "\r\n') for cell in re.split(f"[{_SEPARATORS}]", line)] for line in lines
    )
    if (name := _file_column(names)) is None:
        return False
    measured = measured_keys(asked.given)
    readings = {measured[key] for key in READINGS if key in measured} or {"rotation_rad"}
    if measured.get("time", "time_s") in names and readings & {*names}:
        return False
    below = dict(zip(names, cells, strict=False)).get(name)
    exists = below and trace_file_problem(asked.trace.parent / below) is None
    return bool(exists) or name.lower() == _FILES[0]


def _plain(name: str) -> str:
    return re.sub(r"[ -]+", "_", name.lower())


def _file_column(names: Sequence[str]) -> str | None:
    found = {_plain(name).replace("_", ""): name for name in reversed(names)}
    return next((found[name] for name in _FILES if name in found), None)


def _meant(name: str, cells: Sequence[str]) -> str | None:
    """Return the option that a column is, but for its unit or spelling; None for others."""
    if all(cell.lower() in {*ALIASES, *CANDIDATES} for cell in cells):
        return "model"
    bare, options = re.sub(r"_?[(\[].*$|_[^_]+$", "", _plain(name)), _OF_NUMBERS
    try:
        for cell in cells:
            number_and_unit(cell)
        if {bare, _plain(name)} & _HELD:
            return "hold"
    except ValueError:
        bare, options = _plain(name), _OF_WORDS
    return next(iter(get_close_matches(bare, options, n=1, cutoff=0.75)), None)


def read_table(
    path: Path, config: Path | None = None, options: Sequence[Setting] = ()
) -> list[Asked]:
    """Read the traces of a table with config and options of the command; settings are not checked.

    The table is text in UTF-8: `.tsv` is separated by tabs, another by what its header has. A
    `BiogripError` has line and column of the first few problems: text that is no table, values that
    are no YAML, a trace twice.
    """
    (_, header), *rows = _rows(path)
    if (file := _file_column(header)) is None:
        raise BiogripError(
            f"{place(path, 1)}: found no column '{_FILES[0]}' among {listed(header)}; allowed is "
            f"one.{nearest(_FILES[0], header)}"
        )
    as_options = {name: _plain(name).replace("_", "-") for name in header}
    options_of = {name: option for name, option in as_options.items() if option in OPTIONS}
    problems = list(_column_problems(path, header, rows, {file, *options_of}))
    used = {*options_of, *(name for name in header if "." in name)}
    kept = [(line, row) for line, row in rows if any(row)]
    found: list[Asked] = []
    set_by: list[dict[str, str]] = []
    for line, row in kept:
        if any(row[len(header) :]):
            text = f"found {counted(len(row), 'cell')} in the row, allowed are the header's"
            problems.append(f"{place(path, line)}: {text} {len(header)}.")
        by_name = dict(zip_longest(header, row[: len(header)], fillvalue=""))
        by_name.pop("", None)
        trace = path.parent / by_name.pop(file)
        if trace == path.parent:
            problems.append(f"{place(path, line, file)}: found nothing, allowed is a trace.")
        settings = list(options)
        set_by.append({name: cell for name, cell in by_name.items() if name in used})
        for name, cell in set_by[-1].items():
            where, option = place(path, line, name), options_of.get(name)
            try:
                if cell and not option:
                    settings.append(Setting(where, tuple(name.split(".")), value_of(cell, name)))
                elif cell and option:
                    of_each = cell.split() if option == "fix" else [cell]
                    settings += [setting_of(option, part, where) for part in of_each]
            except BiogripError as error:
                problems.append(f"{where}: {error}")
        copied = {name: cell for name, cell in by_name.items() if name not in used}
        found.append(Asked(trace, config, tuple(settings), place(path, line), copied))
    if not found:
        problems.append(f"{place(path)}: found no traces, allowed is a row for each.")
    parts, before = _parts([own.trace for own in found], set_by), dict[tuple[str, str], int]()
    for index, (own, (line, _), part) in enumerate(zip(found, kept, parts, strict=True)):
        first = before.setdefault((os.path.realpath(own.trace), part), line)
        if first != line and own.trace != path.parent:
            text = f"found '{visible(own.trace)}' again, as on line {first}; allowed is each"
            which = "once, or a column 'reading' that tells which, as in strain=COLUMN"
            problems.append(f"{place(path, line, file)}: {text} trace {which}.")
        found[index] = replace(own, part=part)
    refuse_all(problems)
    return found


def by_sample(asked: Sequence[Asked], *, together: bool = False) -> Iterator[Asked]:
    """Yield samples: rows with one name in a column `sample` are of one, or all `together` are.

    Of other cells, those that differ within a sample stand side by side.
    """
    samples = defaultdict[str | int, list[Asked]](list)
    for number, own in enumerate(asked):
        cells = {_plain(name): cell for name, cell in own.copied.items()}
        samples[_TOGETHER if together else cells.get(_SAMPLE) or number].append(own)
    for name, traces in samples.items():
        first, cells = traces[0], {}
        for column in first.copied:
            every = dict.fromkeys(own.copied.get(column, "") for own in traces)
            cells[column] = "; ".join(every)
        several: dict[str, Any] = {"sample": name, "together": tuple(traces), "copied": cells}
        yield replace(first, **several) if traces[1:] else first


def _parts(traces: Sequence[Path], set_by: Sequence[Mapping[str, str]]) -> list[str]:
    """Return what tells each trace from others of its file: cells of its row that differ there."""
    differ = defaultdict[tuple[str, str], set[str]](set)
    # Resolved, so that links to one file are found.
    files = [os.path.realpath(trace) for trace in traces]
    for file, cells in zip(files, set_by, strict=True):
        for name, cell in cells.items():
            differ[file, name].add(cell)
    return [
        " ".join(cell for name, cell in cells.items() if cell and len(differ[file, name]) > 1)
        for file, cells in zip(files, set_by, strict=True)
    ]


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of every row with its line, the header's first."""
    if problem := trace_file_problem(path):
        raise BiogripError(f"{place(path)}: {problem}")
    try:
        with path.open(encoding="utf-8-sig") as stream:
            text = stream.read(_LONGEST + 1)
        if len(text) > _LONGEST:
            raise ValueError(f"found more than {_LONGEST} characters, allowed are fewer")
        header = text.partition("\n")[0]
        separator = "\t" if path.suffix == ".tsv" else max(_SEPARATORS, key=header.count)
        reader = csv.reader(StringIO(text), delimiter=separator, skipinitialspace=True, strict=True)
        if rows := [(reader.line_num, [*map(str.strip, row)]) for row in reader]:
            if (columns := len(rows[0][1])) > _MOST_COLUMNS or columns * len(rows) > _MOST_CELLS:
                text = f"found {columns} columns and {len(rows)} rows, allowed are {_MOST_COLUMNS}"
                raise ValueError(f"{text} columns and {_MOST_CELLS} cells")
            return rows
        raise ValueError("it is empty")
    except (OSError, ValueError, csv.Error) as error:
        raise BiogripError(f"{place(path)}: cannot be read as a table: {error}.") from error


def _column_problems(
    path: Path, header: Sequence[str], rows: Sequence[tuple[int, list[str]]], used: set[str]
) -> Iterator[str]:
    """Find names that stand twice or are those of results, and what looks like a setting."""
    for number, name in enumerate(header):
        cells = [cell for _, row in rows for cell in row[number : number + 1] if cell]
        where = place(path, 1, name)
        if name and name in header[:number]:
            yield f"{where}: stands twice; allowed is each name once."
        elif name not in used and (name in COLUMNS or _OF_RESULTS.fullmatch(name)):
            yield f"{where}: is a column of the results; allowed is another name."
        elif name and cells and "." not in name and name not in used:
            meant = _meant(name, cells)
            if meant and meant not in map(_plain, header):
                yield (
                    f"{where}: looks like a setting and is none; allowed is '{meant}' for a column "
                    "that sets it, in SI units, or a name unlike a setting's."
                )
