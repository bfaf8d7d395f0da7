"""What is asked of recorded traces, and the case that each of them is.

A setting is a key of the config with a value. Over the defaults lies the user's config, over
that the options of the command, and over these the cells of a table of traces. All are checked as
a config is; messages name the file and line, the option, or the row of the table.

What is read tells the instrument. What is controlled comes from the protocol or, from 0 to the end
of the trace, from ``--hold``, or from a column of the file, ``--load``; where a compliance or a
modulus is read, a hold of 1 needs no option.
"""

import os
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from biogrip.arrays import Array
from biogrip.command.options import Setting
from biogrip.command.words import remarks_on_hold
from biogrip.config.case import SampleCase
from biogrip.config.loading import (
    checked,
    load,
    read_config_of,
    read_configs,
    trace_defaults,
    with_numbers,
)
from biogrip.config.source import HOLD, RAMP, KeyPath, Source, keys_in, overlaid, read_source
from biogrip.config.trace_blocks import LARGEST_PARAMETER, LONGEST_S, SHORTEST_S, TraceConfig
from biogrip.errors import BiogripError
from biogrip.physics.instruments import (
    DISPLACEMENT,
    FORCE,
    GRIPPER,
    INSTRUMENTS,
    KNOWN_SHAPES,
    LOSS,
    STRAIN,
    STRESS,
    Channel,
    Instrument,
)
from biogrip.physics.models import ALIASES, CANDIDATES
from biogrip.traces.columns import held_unit, place, trace_file_problem
from biogrip.traces.measurement_block import ARRAYS, READINGS, MeasurementBlock
from biogrip.traces.reader import Recording, read_recording, recording_of_arrays

MODEL = "generalized_maxwell"
"""Sample model of traces of which nothing says another."""


TRACE = "TRACE"
"""Place of a trace that no table lists."""

LOAD = ("measurement", "load")
"""Key of the column of what was controlled."""

_PROTOCOLS = (HOLD, LOAD, ("protocol",))
# What stands in no name of a file everywhere, and what writes it.
_UNSAFE = re.compile(r"[^\w .,=()+-]")
_PRONY = re.compile(r"(?:prony|sls)_?([1-8])")
# Of each group of keys of the measurement, the one that is set last replaces the others.
_ONE_OF = {"start_s", "fit_start"}, {*READINGS} - {LOSS.name}
_MOST_SHOWN = 10
SEPARATORS = ",;\t"
"""What separates the cells of a table of traces."""
_FILES, _HEAD_BYTES = ("file", "filename", "file_name"), 100_000


@dataclass(frozen=True)
class Asked:
    """A recorded trace, and what is said of it."""

    trace: Path
    """CSV file."""
    config: Path | None = None
    """YAML file laid over the defaults: gripper, protocol, search range, ..."""
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
    sample: str = ""
    """Name of a sample of several traces; the file is then that of its first one."""
    together: tuple["Asked", ...] = ()
    """The traces of such a sample."""

    @property
    def traces(self) -> tuple["Asked", ...]:
        """The traces of the sample: of one, itself."""
        return self.together or (self,)

    @property
    def name(self) -> str:
        """The file, and which of its traces; or the sample."""
        return self.sample or f"{self.trace} {self.part}".rstrip()

    @property
    def output(self) -> Path:
        """The usual JSON file: no two names of traces give one, but those with .csv and without."""
        told = self.sample or self.part
        part = _UNSAFE.sub(lambda mark: quote(os.fsencode(mark[0]), safe=""), told)
        file = "" if self.sample else self.trace.name.removesuffix(".csv")
        name = ".".join(filter(None, (file, part)))
        return self.trace.with_name(f"{name}.identified.json")

    @property
    def configs(self) -> list[Path]:
        """The user's config, if there is one."""
        return [self.config] if self.config else []

    @property
    def given(self) -> dict[str, Any]:
        """Blocks of the user's: those of the config, and over them the settings.

        The load and the depth of a shape are what they count as.
        """
        blocks, _ = read_config_of(TraceConfig, self.configs)
        for setting in self.settings:
            blocks = _laid_over(blocks, setting)
        counts_as = _by_shape(measured := measured_keys(blocks))
        for name in {*measured} & ({*counts_as.values()} - {*counts_as}):
            read = f"{[*counts_as][name == STRAIN.name]}={measured[name]}"
            raise BiogripError(
                f"{self.place}: found a shape and a reading of {name}; allowed are "
                f"{' and '.join(counts_as)}, as by --reading {shlex.quote(read)}."
            )
        renamed = {counts_as.get(key, key): value for key, value in measured.items()}
        return {**blocks, "measurement": renamed} if counts_as else blocks

    def refuse_missing(self) -> None:
        """Raise a `BiogripError` if there is no such file."""
        if not self.arrays and (problem := trace_file_problem(self.trace)):
            raise BiogripError(f"{self.place}: {problem}")

    def read(self, columns: MeasurementBlock) -> Recording:
        """Read the trace; a `BiogripError` has file, line and column, or array and index."""
        if self.arrays:
            return recording_of_arrays(columns, *self.arrays)
        return read_recording(self.trace, columns)


def _by_shape(measured: Mapping[str, Any]) -> dict[str, str]:
    """Return as which stress and strain the load and the depth of a shape count; {} without one."""
    if (text := measured.get("shape")) is None:
        return {}
    shape = KNOWN_SHAPES.get(str(text).strip().partition(" ")[0])
    load = shape.load if shape else FORCE
    return {load.name: STRESS.name, DISPLACEMENT.name: STRAIN.name}


def measured_keys(blocks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of the measurement; none where no block is given for it."""
    measured = blocks.get("measurement")
    return measured if isinstance(measured, dict) else {}


def _laid_over(blocks: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """Return the blocks with a setting, and without what it replaces."""
    path, value = setting.path, deepcopy(setting.value)
    for group in _ONE_OF if path[0] == "measurement" else ():
        for name in group if group & {*path[1:2]} else ():
            measured_keys(blocks).pop(name, None)
    # A candidate's name says its branches, too.
    name = str(value).lower() if path == ("sample", "model") else ""
    if prony := _PRONY.fullmatch(name):
        name = f"generalized_maxwell_{prony[1]}".removesuffix("_1")
        blocks = overlaid(blocks, {"fixed": {"c_p": 0.0}})
    if name == "jeffreys":
        # A Burgers fluid whose spring is rigid.
        name, blocks = "burgers", overlaid(blocks, {"fixed": {"k_s": LARGEST_PARAMETER}})
    if sample := CANDIDATES.get(ALIASES.get(name, name)):
        path, value = ("sample",), {"model": sample.name, "branches": sample.branches}
    for part in reversed(path):
        value = {part: value}
    return overlaid(blocks, value)


def is_table(asked: Asked) -> bool:
    """Return True if the first line of a file is a header with a column `file`, and no trace's.

    Nor is it one of a preamble, as ``Filename`` of TRIOS, above the names that are to be read.
    """
    with asked.trace.open("rb") as stream:
        lines = stream.read(_HEAD_BYTES).decode("utf-8-sig", "replace").splitlines()
    rows = [[it.strip(' "') for it in re.split(f"[{SEPARATORS}]", line)] for line in lines or [""]]
    measured = measured_keys(asked.given)
    readings = {measured[key] for key in READINGS if key in measured} or {"rotation_rad"}
    axes = {measured.get("time", "time_s"), measured.get("frequency")}
    of_trace = any(axes & {*row} and readings & {*row} for row in rows)
    return file_column(rows[0]) is not None and not of_trace


def file_column(names: Sequence[str]) -> str | None:
    """Return the first column that is named for files of traces, if there is one."""
    return next((name for name in names if column_as_option(name) in _FILES), None)


def column_as_option(name: str) -> str:
    """Return a name of a column as an option would be written, but for its hyphens."""
    return re.sub(r"[ -]+", "_", name.lower())


def read_trace(asked: Asked) -> tuple[Recording, SampleCase]:
    """Read a trace, and return it with the case that it is.

    A `BiogripError` has file, line and column, or setting, that cannot be used.
    """
    asked.refuse_missing()
    case, recording = case_of(asked)
    columns = case.block.measurement
    # What its protocol follows from was read before the protocol's start was known.
    recording = replace(recording, read=columns) if recording else asked.read(columns)
    said = (*recording.remarks_before, *remarks_on_hold(recording, case, asked.given))
    return replace(recording, remarks_before=said), case


def case_of(asked: Asked) -> tuple[SampleCase, Recording | None]:
    """Return the case that a trace is, and the trace if its protocol follows from it.

    A `BiogripError` has option, row, or file, line and key, if settings or config cannot be used.
    """
    given = asked.given
    _refuse_two_protocols(asked, given)
    files = [trace_defaults(), *asked.configs]
    merged = overlaid(read_configs([trace_defaults()]), given)
    merged, recording, record = _with_instrument(merged, given, asked)
    merged["sample"] = overlaid({"model": MODEL}, merged.get("sample", {}))
    known = {*keys_in(read_configs(files))}
    sources = [*map(read_source, files)]
    sources += (_source(setting, known, merged) for setting in asked.settings)
    config = load(TraceConfig, merged, sources)
    name = re.sub(r"[^A-Za-z0-9_-]", "_", asked.trace.stem)[:60]
    name = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    return SampleCase(name, config, config, record), recording


def _refuse_two_protocols(asked: Asked, given: Mapping[str, Any]) -> None:
    if len(protocols := [key for key in _PROTOCOLS if key in keys_in(given)]) > 1:
        said = " and ".join(map(".".join, protocols))
        raise BiogripError(f"{asked.place}: found {said}; allowed is one of them.")


def _source(setting: Setting, known: set[KeyPath], merged: Mapping[str, Any]) -> Source:
    """Return the keys that a setting is to be named for: its own, and blocks that it adds."""
    path: KeyPath = setting.path
    if path[0] == "measurement" and (counts_as := _by_shape(measured_keys(merged))):
        path = (path[0], *(counts_as.get(str(key), key) for key in path[1:]))
    held = {"protocol": merged["protocol"]}
    keys = keys_in(held) if path in (HOLD, RAMP, LOAD) else keys_in(setting.value, path)
    above = [path[:length] for length in range(1, len(path)) if path[:length] not in known]
    return setting.by, dict.fromkeys([*above, path, *keys])


def _with_instrument(
    merged: Mapping[str, Any], given: Mapping[str, Any], asked: Asked
) -> tuple[dict[str, Any], Recording | None, Array | None]:
    """Return the blocks with the trace's file, its instrument, and a protocol that suits it.

    The protocol is, in this order: none that counts, of a sweep; a hold, or a recorded load, from
    its start to the trace's end; the config's, or the gripper's usual one; a hold of 1, where what
    is read is relative to it. Where it follows from the trace, this is returned, too, and what was
    controlled, if it was recorded, see `Experiment.record`.
    """
    blocks = {name: block for name, block in merged.items() if name not in (*HOLD, *RAMP)}
    if not isinstance(merged["measurement"], dict):
        return blocks, None, None
    held, by, ramp_s = merged.get(HOLD[0]), _place_of(HOLD, asked), merged.get(RAMP[0], 0.0)
    instrument = _instrument(merged, given)
    measurement = _measurement_of(asked, merged["measurement"], instrument)
    if ramp_s and (instrument.sweeps or measurement.get(LOAD[-1]) or "protocol" in given):
        raise BiogripError(f"{_place_of(RAMP, asked)}: goes with --hold; leave it out.")
    if ramp_s and instrument.relative:
        # What a rising strain is divided by, that of its end or its own, nothing tells.
        risen_s = (measurement.get("start_s") or 0.0) + ramp_s
        measurement["from_s"] = max(measurement.get("from_s") or risen_s, risen_s)
    kind = given.get("instrument", instrument.kind)
    blocks |= {"instrument": kind, "measurement": measurement}
    block = checked(MeasurementBlock, measurement)[0]
    controlled = (instrument if block is None else block.instrument).controlled
    if instrument.read == LOSS and "sample" not in given:
        said = "loss: of a loss modulus alone no springs are told that do not relax"
        raise BiogripError(f"{said}; allowed with a model, as by --model zener_maxwell.")
    if instrument.sweeps and held is not None:
        raise BiogripError(f"{by}: is of a trace in time, not of a sweep; leave it out.")
    if not instrument.sweeps and held is None and measurement.get(LOAD[-1]) is None:
        if "protocol" in given or instrument.has_jaws:
            return blocks, None, None
        if not instrument.relative:
            unit = f" in {controlled.unit}" if controlled.unit else ""
            raise BiogripError(
                f"{by}: is missing; allowed is the {controlled.name}{unit} that was held, a "
                "column of it by --load, or a protocol in --config."
            )
    if instrument.sweeps or block is None:
        # If there is no block, the check of the config will say why.
        return _with_hold(blocks, controlled), None, None
    level = 1.0 if held is None else controlled.in_si(*held_unit(held, controlled, by))
    try:
        recording = asked.read(block)
    except BiogripError:
        # Whoever uses the trace says what is wrong.
        return _with_hold(blocks, controlled, level), None, None
    start_s = measurement.get("start_s")
    if recording.load is None:
        lasts_s = _duration(recording, start_s)
        if ramp_s >= lasts_s:
            text = f"found {ramp_s:g} s, allowed is less than the trace's {lasts_s:g} s"
            raise BiogripError(f"{_place_of(RAMP, asked)}: {text}.")
        return _with_hold(blocks, controlled, level, lasts_s, ramp_s), recording, None
    touching = recording.load
    if block.tip_power is not None:
        touching = np.maximum(touching, (-np.inf, 0.0))
    if start_s is None:
        # With its first row, or before it, if the load is there.
        first_s, first = touching[0].tolist()
        start_s = min(first_s, 0.0) if first else first_s
        blocks["measurement"] = measurement | {"start_s": start_s or None}
    record = _from(recording.load, start_s)
    largest = float(max(touching[:, 1], key=abs))
    if instrument.relative and largest:
        record[:, 1] /= largest
    return _with_hold(blocks, controlled, largest, float(record[-1, 0])), recording, record


def _place_of(path: KeyPath, asked: Asked) -> str:
    """Return the option, or the cell of a table, that says what was held, or how it was reached."""
    row = "" if asked.place == TRACE else f"{asked.place}: "
    said = (setting.by for setting in asked.settings[::-1] if setting.path == path)
    return next(said, f"{row}{path[0]}")


def _measurement_of(
    asked: Asked, given: Mapping[str, Any], instrument: Instrument
) -> dict[str, Any]:
    """Return the block of the measurement, with its file and the usual names of columns."""
    axis = {"frequency": "omega_rad_per_s"} if instrument.sweeps else {"time": "time_s"}
    usual = {**axis, instrument.read.name: instrument.read.column}
    file = str(asked.trace)
    # A block cannot have a name that is not valid text.
    if asked.arrays or file.encode(errors="ignore").decode() != file:
        file = ARRAYS
    measurement: dict[str, Any] = with_numbers(MeasurementBlock, {**usual, **given, "file": file})
    return measurement


def _with_hold(
    blocks: Mapping[str, Any],
    controlled: Channel,
    level: float = 1.0,
    lasts_s: float = 1.0,
    ramp_s: float = 0.0,
) -> dict[str, Any]:
    """Return the blocks with a protocol of one hold, that is reached at once or linearly."""
    column = controlled.column
    phases = [{"duration_s": lasts_s - ramp_s, column: level}]
    if ramp_s:
        phases.insert(0, {"duration_s": ramp_s, column: 0.0, f"to_{column}": level})
    return {**blocks, "protocol": {"phases": phases}}


def _duration(recording: Recording, start_s: float | None) -> float:
    """Return the time from the start of what was held, by default 0, to the last reading."""
    first_s = start_s or min(float(recording.time_s[0]), 0.0)
    lasts_s = float(recording.time_s[-1]) - first_s
    if lasts_s > 0 and not SHORTEST_S <= lasts_s <= LONGEST_S:
        raise BiogripError(
            f"{place(recording.path)}: found {lasts_s:g} s from the protocol's start, at "
            f"{first_s:g} s, to the last reading; allowed are {SHORTEST_S:g} to {LONGEST_S:g} s. "
            "Is the unit of time right? Or say when it started (--start)."
        )
    return lasts_s if lasts_s > 0 else 1.0


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

    So are traces of different quantities, but of one sample. A `BiogripError` has the first few
    problems.
    """
    every = [trace for own in traces for trace in own.traces]
    every = [trace for trace in every if not trace_file_problem(trace.trace)]
    for config in dict.fromkeys(file for asked in every for file in asked.configs):
        for note in read_config_of(TraceConfig, [config])[1]:
            print(note, file=sys.stderr)
    read: dict[str, str] = {}
    problems: dict[str, None] = {}
    for own in every:
        key = repr([(setting.path, setting.value) for setting in own.settings])
        if key in read:
            continue
        try:
            read[key] = case_of(own)[0].instrument.read.name
        except BiogripError as error:
            read[key] = ""
            problems |= dict.fromkeys(str(error).split("\n"))
        first, *others = dict.fromkeys(filter(None, read.values())) or [""]
        if read[key] in others and own in traces:
            text = f"{own.place}: found a reading of {read[key]}, but a reading of {first} before; "
            problems[f"{text}allowed is one quantity read for all traces of a command."] = None
    refuse_all([*problems])


def refuse_all(problems: Sequence[str]) -> None:
    """Raise a `BiogripError` of the first few problems, if there are any."""
    more = [f"... and {len(problems) - _MOST_SHOWN} more."] if problems[_MOST_SHOWN:] else []
    if problems:
        raise BiogripError("\n".join([*problems[:_MOST_SHOWN], *more]))
