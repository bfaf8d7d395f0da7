"""What is asked of recorded traces, and the study of one case that each of them is.

A setting is a key of the config with a value. Over the default study lies the user's config, over
that the options of the command, and over these the cells of a table of traces. All are checked as
a config is; messages name the file and line, the option, or the row of the table.

What is read tells the instrument. What is controlled comes from the protocol or, from 0 to the end
of the trace, from ``--hold``, or from a column of the file, ``--load``; where a compliance or a
modulus is read, a hold of 1 needs no option.
"""

import csv
import os
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from io import StringIO
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.command.options import OPTIONS, REPLACED, Setting
from biogrip.command.outputs import COLUMNS
from biogrip.digits import counted, plain
from biogrip.errors import BiogripError, nearest
from biogrip.identify.other_fits import Trace
from biogrip.physics.instruments import (
    DISPLACEMENT,
    FORCE,
    GRIPPER,
    INSTRUMENTS,
    STRAIN,
    STRESS,
    Instrument,
)
from biogrip.physics.models import ALIASES, CANDIDATES
from biogrip.physics.shapes import SHAPES
from biogrip.study.experiment_blocks import LONGEST_S, SHORTEST_S
from biogrip.study.messages import checked, with_numbers
from biogrip.study.source import (
    HOLD,
    KeyPath,
    Source,
    default_config,
    dotted,
    keys_in,
    overlaid,
    value_of,
)
from biogrip.study.study import Case, load_study, read_configs
from biogrip.terminal import visible
from biogrip.traces.columns import (
    held_unit,
    listed,
    number_and_unit,
    place,
    shape_and_sizes,
    trace_file_problem,
)
from biogrip.traces.measurement_block import ARRAYS, READINGS, ByOptions, MeasurementBlock
from biogrip.traces.reader import Recording, read_recording, recording_of_arrays

MODEL = "generalized_maxwell"
"""Sample model of traces of which nothing says another."""

_FILES = ("file", "filename", "filepath", "path", "trace", "tracefile")

TRACE = "TRACE"
"""Place of a trace that no table lists."""

LOAD = ("measurement", "load")
"""Key of the column of what was controlled."""

_OF_NUMBERS = ("hold", "noise", "noise_share", "start", "from", "until")
_OF_WORDS = ("noise_model", "offset", "drift", "reading", "shape")
# Other names of what is held.
_HELD = ("held", "load", "pressure_Pa", "indentation_m")
_PROTOCOLS = (HOLD, LOAD, ("protocol",))
_PRONY = re.compile(r"prony_?([1-8])")
# Share of the largest load so far below which a contact shrinks, not only scatters.
_STAYS = 0.9
# Of each group of keys of the measurement, the one that is set last replaces the others.
_ONE_OF = {"start_s", "fit_start"}, {*READINGS}
_MOST_SHOWN = 10
_SEPARATORS = ",;\t"
# Blocks whose numbers are an instrument's.
_INSTRUMENT = ("gripper", "actuator")
_OF_RESULTS = re.compile(r".* (verdict|value|low|high)( \(.*\))?")
_HEAD_BYTES = 100_000


@dataclass(frozen=True)
class Asked:
    """A recorded trace, and what is said of it."""

    trace: Path
    """CSV file."""
    config: Path | None = None
    """YAML file laid over the default study: gripper, protocol, search range, ..."""
    settings: tuple[Setting, ...] = ()
    """Settings laid over the config, the later over the earlier."""
    place: str = TRACE
    """Row of a table that lists the trace, for messages."""
    copied: Mapping[str, str] = field(default_factory=dict)
    """Other cells of that row, by column."""
    part: str = ""
    """What tells the trace from others of its file: cells of its row."""
    arrays: tuple[Array, ...] = ()
    """Times, readings and perhaps standard deviations, (n_samples,) each, instead of a file."""

    @property
    def name(self) -> str:
        """The file, and which of its traces."""
        return f"{self.trace} {self.part}".rstrip()

    @property
    def output(self) -> Path:
        """The usual JSON file."""
        part = re.sub(r"[^\w.-]+", "_", f".{self.part}").rstrip(".")
        return self.trace.with_name(f"{self.trace.stem}{part}.identified.json")

    @property
    def configs(self) -> list[Path]:
        """The user's config, if there is one."""
        return [self.config] if self.config else []

    @property
    def given(self) -> dict[str, Any]:
        """Blocks of the user's: those of the config, and over them the settings.

        The load and the depth of a shape are what they count as.
        """
        blocks = read_configs(self.configs)
        for setting in self.settings:
            blocks = _laid_over(blocks, setting)
        counts_as = _by_shape(measured := _measured(blocks))
        for name in {*measured} & ({*counts_as.values()} - {*counts_as}):
            raise BiogripError(
                f"{self.place}: found a shape and a reading of {name}; allowed are "
                f"{' and '.join(counts_as)}, as by --reading {[*counts_as][name == STRAIN.name]}="
                "COLUMN."
            )
        renamed = {counts_as.get(key, key): value for key, value in measured.items()}
        return {**blocks, "measurement": renamed} if counts_as else blocks

    def read(self, columns: MeasurementBlock) -> Recording:
        """Read the trace; a `BiogripError` has file, line and column, or array and index."""
        if self.arrays:
            return recording_of_arrays(columns, *self.arrays)
        return read_recording(self.trace, columns)


def _by_shape(measured: Mapping[str, Any]) -> dict[str, str]:
    """Return as which stress and strain the load and the depth of a shape count; {} without one."""
    if (text := measured.get("shape")) is None:
        return {}
    shape = SHAPES.get(str(text).strip().partition(" ")[0])
    load = shape.load if shape else FORCE
    return {load.name: STRESS.name, DISPLACEMENT.name: STRAIN.name}


def _measured(blocks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of the measurement; none where no block is given for it."""
    measured = blocks.get("measurement")
    return measured if isinstance(measured, dict) else {}


def _laid_over(blocks: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """Return the blocks with a setting, and without what it replaces."""
    path, value = setting.path, deepcopy(setting.value)
    for group in _ONE_OF if path[0] == "measurement" else ():
        for name in group if group & {*path[1:2]} else ():
            _measured(blocks).pop(name, None)
    # A candidate's name says its branches, too.
    name = str(value).lower() if path == ("sample", "model") else ""
    if prony := _PRONY.fullmatch(name):
        name = f"generalized_maxwell_{prony[1]}".removesuffix("_1")
        blocks = overlaid(blocks, {"fixed": {"c_p": 0.0}})
    if sample := CANDIDATES.get(ALIASES.get(name, name)):
        path, value = ("sample",), {"model": sample.name, "branches": sample.branches}
    for part in reversed(path):
        value = {part: value}
    return overlaid(blocks, value)


def read_trace(asked: Asked) -> tuple[Recording, Case]:
    """Read a trace, and return it with the case that it is.

    A `BiogripError` has file, line and column, or setting, that cannot be used.
    """
    case, recording = case_of(asked)
    columns = ByOptions(**vars(case.block.measurement))
    # What its protocol follows from was read before the protocol's start was known.
    recording = replace(recording, read=columns) if recording else asked.read(columns)
    return replace(recording, remarks_before=remarks_on_hold(recording, case, asked.given)), case


def study_of(asked: Asked) -> tuple[str, dict[str, Any], Recording | None, Array | None]:
    """Return the study of one case that a trace is, not checked, and the name of the case.

    The trace comes along if its protocol follows from it, and what was controlled if it was
    recorded.
    """
    given = asked.given
    if len(found := [key for key in _PROTOCOLS if key in keys_in(given)]) > 1:
        of_config = [*keys_in(read_configs(asked.configs))]
        said = [".".join(key) + f" of {asked.config}" * (key in of_config) for key in found]
        raise BiogripError(f"{asked.place}: found {' and '.join(said)}; allowed is one of them.")
    merged = overlaid(read_configs([default_config()]), given)
    merged, recording, record = _with_instrument(merged, given, asked)
    # Cases and a table of the config are meant for the workflow.
    for name in ("only", "traces"):
        merged.pop(name, None)
    name = re.sub(r"[^A-Za-z0-9_-]", "_", asked.trace.stem)[:60]
    case = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    merged["cases"] = {case: {"sample": overlaid({"model": MODEL}, merged.pop("sample", {}))}}
    return case, merged, recording, record


def case_of(asked: Asked) -> tuple[Case, Recording | None]:
    """Return the case that a trace is, and the trace if its protocol follows from it.

    A `BiogripError` has option, row, or file, line and key, if settings or config cannot be used.
    """
    case, merged, recording, record = study_of(asked)
    files = [default_config(), *asked.configs]
    known = {*keys_in(read_configs(files))}
    sources = [_source(setting, known, merged, case) for setting in asked.settings]
    try:
        study = load_study(merged, files, over=sources)
    except BiogripError as error:
        _, *problems = str(error).replace(f"cases.{case}.", "").split("\n")
        raise BiogripError("\n".join(problems)) from error
    return replace(study.cases[case], record=record), recording


def _source(setting: Setting, known: set[KeyPath], merged: Mapping[str, Any], case: str) -> Source:
    """Return the keys that a setting is to be named for: its own, and blocks that it adds."""
    path: KeyPath = setting.path
    if path[0] == "sample":
        path = ("cases", case, *path)
    if path[0] == "measurement" and (counts_as := _by_shape(merged["measurement"])):
        path = (path[0], *(counts_as.get(str(key), key) for key in path[1:]))
    held = {"protocol": merged["protocol"]}
    own = keys_in(held) if path in (HOLD, LOAD) else keys_in(setting.value, path)
    above = [path[:length] for length in range(1, len(path)) if path[:length] not in known]
    return setting.by, dict.fromkeys([*above, path, *own])


def _with_instrument(
    merged: dict[str, Any], given: Mapping[str, Any], asked: Asked
) -> tuple[dict[str, Any], Recording | None, Array | None]:
    """Return the blocks with the trace's file, its instrument, and a protocol of that.

    Where the protocol follows from the trace, it is returned, too, and what was controlled, if it
    was recorded, see `Experiment.record`.
    """
    level = merged.pop(HOLD[0], None)
    row = "" if asked.place == TRACE else f"{asked.place}: "
    by = next((it.by for it in asked.settings[::-1] if it.path == HOLD), f"{row}--hold")
    if not isinstance(merged["measurement"], dict):
        return merged, None, None
    instrument = _instrument(merged, given)
    axis = {"frequency": "omega_rad_per_s"} if instrument.sweeps else {"time": "time_s"}
    usual = {**axis, instrument.read.name: instrument.read.column}
    file = ARRAYS if asked.arrays else str(asked.trace)
    measurement = usual | merged["measurement"] | {"file": file}
    measurement = with_numbers(MeasurementBlock, measurement)
    kind = given.get("instrument", instrument.kind)
    block = checked(MeasurementBlock, measurement)[0]
    controlled = (instrument if block is None else block.instrument).controlled
    found = {**merged, "instrument": kind, "measurement": measurement}
    # Load and length are filled in below, as far as they are known.
    phase = {"duration_s": 1.0, controlled.column: 1.0}
    held = {**found, "protocol": {"phases": [phase]}}
    if instrument.sweeps:
        if level is not None:
            raise BiogripError(f"{by}: is of a trace in time, not of a sweep; leave it out.")
        return held, None, None
    if level is None and measurement.get(LOAD[-1]) is None:
        if "protocol" in given or instrument.has_jaws:
            return found, None, None
        if not instrument.relative:
            unit = f" in {controlled.unit}" if controlled.unit else ""
            raise BiogripError(
                f"{by}: is missing; allowed is the {controlled.name}{unit} that was held, a "
                "column of it by --load, or a protocol in --config."
            )
    if block is None:
        # The study will say why.
        return held, None, None
    if level is not None:
        phase[controlled.column] = controlled.in_si(*held_unit(level, controlled, by))
    try:
        own = asked.read(block)
    except BiogripError:
        # Whoever uses the trace says what is wrong.
        return held, None, None
    record, start_s = None, measurement.get("start_s")
    if own.load is not None:
        first_s, first = own.load[0].tolist()
        # A load that is there in the first row came before it: at 0, as one that is held.
        if start_s is None:
            start_s = min(first_s, 0.0) if first else first_s
            measurement["start_s"] = start_s or None
        record = _from(own.load, start_s)
        largest = max(record[:, 1], key=abs)
        if instrument.relative:
            record[:, 1] /= largest
        phase |= {"duration_s": float(record[-1, 0]), controlled.column: float(largest)}
    else:
        first = start_s or min(float(own.time_s[0]), 0.0)
        lasts = float(own.time_s[-1]) - first
        phase["duration_s"] = lasts if lasts > 0 else 1.0
        if lasts > 0 and not SHORTEST_S <= lasts <= LONGEST_S:
            raise BiogripError(
                f"{place(own.path)}: found {lasts:g} s from the protocol's start, at {first:g} s, "
                f"to the last reading; allowed are {SHORTEST_S:g} to {LONGEST_S:g} s. Is the unit "
                "of time right? Or say when it started (--start)."
            )
    return held, own, record


def _from(load: Array, start_s: float) -> Array:
    """Return rows of times and loads, (n, 2), from a time on, counted from it.

    Up to a first row that comes later, it goes on in a line if one row is missing and three go on
    in nearly one, as of a sine; else it was held.
    """
    after = load[load[:, 0] > start_s]
    first, times_s = np.interp(start_s, *load.T), load[:3, 0]
    rate, next_rate = np.diff(load[:3, 1]) / np.diff(times_s)
    earlier_s = times_s[0] - start_s
    if earlier_s < 1.5 * (times_s[1] - times_s[0]) and abs(next_rate - rate) < 0.5 * abs(rate):
        first -= rate * max(earlier_s, 0.0)
    return np.vstack(((start_s, first), after)) - (start_s, 0.0)


def _instrument(merged: Mapping[str, Any], given: Mapping[str, Any]) -> Instrument:
    for name in INSTRUMENTS:
        if name in merged["measurement"]:
            return INSTRUMENTS[name]
    kind = given.get("instrument", GRIPPER.kind)
    some = [each for each in INSTRUMENTS.values() if each.kind == kind] or [GRIPPER]
    keys = {path[-1] for path in keys_in(merged.get("protocol"))}
    return next((each for each in some if each.controlled.column in keys), some[0])


def check_settings(traces: Sequence[Asked]) -> None:
    """Refuse settings that cannot be used, of all traces at once, before anything is fitted.

    So are traces of different quantities. A `BiogripError` has the first few problems.
    """
    read: dict[str, str] = {}
    problems: dict[str, None] = {}
    for own in traces:
        key = repr([(setting.path, setting.value) for setting in own.settings])
        if key in read:
            continue
        try:
            read[key] = case_of(own)[0].instrument.read.name
        except BiogripError as error:
            read[key] = ""
            problems |= dict.fromkeys(str(error).split("\n"))
        first, *others = dict.fromkeys(filter(None, read.values())) or [""]
        if read[key] in others:
            text = f"{own.place}: found a reading of {read[key]}, but a reading of {first} before; "
            problems[f"{text}allowed is one quantity read for all traces of a command."] = None
    _refuse([*problems])


def _refuse(problems: Sequence[str]) -> None:
    more = [f"... and {len(problems) - _MOST_SHOWN} more."] if problems[_MOST_SHOWN:] else []
    if problems:
        raise BiogripError("\n".join([*problems[:_MOST_SHOWN], *more]))


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
    measured = _measured(asked.given)
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
    """Return the option or key that a column is, but for its prefix, unit or spelling."""
    if all(cell.lower() in {*ALIASES, *CANDIDATES} for cell in cells):
        return "model"
    plain = _plain(name)
    try:
        for cell in cells:
            number_and_unit(cell)
    except ValueError:
        return next((word for word in _OF_WORDS if _misspelt(plain, word)), None)
    blocks = read_configs([default_config()])
    keys = [path for path in keys_in(blocks) if path[0] in _INSTRUMENT]
    known = {str(path[-1]): dotted(path) for path in keys} | dict.fromkeys(_HELD, "hold")
    known |= {each.controlled.column: "hold" for each in INSTRUMENTS.values()}
    known |= {dotted(path).replace(".", "_"): dotted(path) for path in keys}
    known |= {name: name for name in _OF_NUMBERS}
    by_plain = {re.sub("_[^_]+$", "", key).lower(): meant for key, meant in known.items()}
    by_plain |= {key.lower(): meant for key, meant in known.items()}
    bare = re.sub(r"_?[(\[].*$|_[^_]+$", "", plain)
    if plain in by_plain or by_plain.get(bare) in _OF_NUMBERS:
        return by_plain.get(plain, by_plain.get(bare))
    near = get_close_matches(plain, [key for key in by_plain if "_" in key], n=1, cutoff=0.9)
    near += [key for key in _OF_NUMBERS if _misspelt(plain, key)]
    return by_plain[near[0]] if near else None


def _misspelt(name: str, option: str) -> bool:
    """Return True if a name has an option's letters in another order, or nearly in theirs."""
    close = len(name) > 3 and get_close_matches(name, [option], cutoff=0.8)
    return bool(close) or sorted(name) == sorted(option)


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
    options_of = {name: _plain(name) for name in header if _plain(name) in OPTIONS}
    problems = list(_column_problems(path, header, rows, {file, *options_of}))
    used = {"", *options_of, *(name for name in header if "." in name)}
    kept = [(line, row) for line, row in rows if any(row)]
    found: list[Asked] = []
    set_by: list[dict[str, str]] = []
    for line, row in kept:
        if any(row[len(header) :]):
            text = f"found {counted(len(row), 'cell')} in the row, allowed are the header's"
            problems.append(f"{place(path, line)}: {text} {len(header)}.")
        by_name = dict(zip_longest(header, row[: len(header)], fillvalue=""))
        trace = path.parent / by_name.pop(file)
        if trace == path.parent:
            problems.append(f"{place(path, line, file)}: found nothing, allowed is a trace.")
        settings = list(options)
        set_by.append({name: cell for name, cell in by_name.items() if name in used})
        for name, cell in set_by[-1].items():
            where = place(path, line, name)
            try:
                settings += _settings_of(cell, name, options_of.get(name), where)
            except (BiogripError, ValueError) as error:
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
    _refuse(problems)
    return found


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


def _settings_of(cell: str, name: str, option: str | None, by: str) -> Iterator[Setting]:
    """Yield what a cell sets, in a column named after an option, or after a key with dots."""
    if not (name and cell):
        return
    key = name if option is None else OPTIONS[option]
    if isinstance(key, str):
        yield Setting(by, tuple(key.split(".")), value_of(cell, name))
        return
    for part in cell.split() if option == "fix" else [cell]:
        yield Setting(by, *key(part))


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of every row with its line, the header's first."""
    if problem := trace_file_problem(path):
        raise BiogripError(f"{place(path)}: {problem}")
    try:
        text = path.read_text(encoding="utf-8-sig")
        header = text.partition("\n")[0]
        separator = "\t" if path.suffix == ".tsv" else max(_SEPARATORS, key=header.count)
        reader = csv.reader(StringIO(text), delimiter=separator, skipinitialspace=True, strict=True)
        if rows := [(reader.line_num, [*map(str.strip, row)]) for row in reader]:
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
        elif new := REPLACED.get(_plain(name)):
            yield f"{where}: is now the column '{new}', with cells as in 'sphere 2.5 um'."
        elif name not in used and (name in COLUMNS or _OF_RESULTS.fullmatch(name)):
            yield f"{where}: is a column of the results; allowed is another name."
        elif name and cells and "." not in name and name not in used:
            meant = _meant(name, cells)
            if meant and meant not in map(_plain, header):
                yield (
                    f"{where}: looks like a setting and is none; allowed is '{meant}' for a column "
                    "that sets it, in SI units, or a name unlike a setting's."
                )


def load_in_words(trace: Trace, case: Case, given: Mapping[str, Any]) -> str:
    """Return what was held or loaded; nothing where a config has the protocol.

    Given are the blocks of the config that the user has set.
    """
    (recording, experiment), measured = trace, case.block.measurement
    controlled, start_s = measured.instrument.controlled, measured.start_s or 0.0
    if recording.load is not None and experiment.record is not None:
        column, loads = recording.form["columns"]["load"], experiment.record[:, 1]
        if case.instrument.relative:
            loads = loads * getattr(case.block.protocol.phases[0], controlled.column)
        ends = loads.min(), loads.max()
        low, high = (plain(controlled.in_unit(end, column["unit"])) for end in ends)
        what = _with_unit(high if low == high else f"{low} to {high}", column["unit"])
        count = np.count_nonzero(recording.load[:, 0] >= start_s)
        rows = f"column {column['column']}, {count:,} rows"
        return f"Load: {what} from {start_s:g} s ({rows}){_contact(case)}."
    if HOLD[0] not in given:
        return ""
    number, unit = held_unit(given[HOLD[0]], controlled)
    start = "its start, as fitted," if experiment.fit_start else f"{start_s:g} s"
    what = f"{_with_unit(f'{number:g}', unit)} from {start} to {recording.form['last_s']:g} s"
    return f"Held: {what}{_contact(case)}."


def _contact(case: Case) -> str:
    """Return what turns a load and a depth into a stress and a strain."""
    if (text := case.block.measurement.shape) is None:
        return ""
    return f", by the shape {text} ({shape_and_sizes(text)[0].source})"


def _shrinks(recording: Recording, case: Case) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, where its contact has no such sum."""
    instrument = case.block.measurement.instrument
    if recording.load is None or instrument.read.power == instrument.controlled.power == 1:
        return ()
    time_s, loads = recording.load[recording.load[:, 0] <= recording.form["last_s"]].T
    most = np.maximum.accumulate(loads)
    falls = time_s[(most > 0.1 * most[-1]) & (loads < _STAYS * most)]
    if not len(falls):
        return ()
    return (
        f"The contact shrinks from {falls[0]:g} s on: what is said holds while it grows or stays. "
        f"Leave these readings out: --until {falls[0]:g}.",
    )


def _with_unit(number: str, unit: str) -> str:
    return number if unit == "1" else f"{number} {unit}"


def remarks_on_hold(recording: Recording, case: Case, given: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, or what was held may be in another unit.

    That is if readings have a unit with a prefix, and what was held is a number.
    """
    if shrinks := _shrinks(recording, case):
        return shrinks
    read, controlled = case.instrument.read, case.instrument.controlled
    unit, held = recording.units[1], given.get(HOLD[0])
    prefix = unit.removesuffix(read.unit)
    if held is None or not (prefix and read.unit and controlled.unit) or prefix == unit:
        return ()
    number, own = held_unit(held, controlled)
    if own != controlled.unit or str(held).rstrip().endswith(own):
        return ()
    likely = prefix + controlled.unit
    likely = likely if likely in controlled.units else controlled.unit
    return (
        f"The {read.name} is in {unit}, but what was held, {number:g}, is taken to be in {own}: "
        f'say its unit, as in --hold "{number:g} {likely}".',
    )
