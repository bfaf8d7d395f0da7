"""Parquet files with columns of numbers and text.

Arrays share memory with Arrow: Arrow's own conversions import pandas first, which takes longer
than everything else in a short job.

Files of targets and measurements.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from biogrip.arrays import Array, parts
from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.files import atomic_write
from biogrip.physics.instruments import INSTRUMENTS, Instrument
from biogrip.records.rows import write_rows
from biogrip.traces.reader import Recognised

Table: TypeAlias = pa.Table


def table_of(columns: Mapping[str, NDArray[Any] | str], rows: int) -> Table:
    """Return a table of numbers, (rows,) each, and of text that is the same in every row."""
    return pa.table(
        {
            name: _words(values, rows) if isinstance(values, str) else _numbers(values)
            for name, values in columns.items()
        }
    )


def write_tables(path: Path, tables: Sequence[Table], *, dictionary: bool = True) -> None:
    """Write tables of `table_of` with equal columns to one file, one after another.

    Dictionary encoding pays for repeated values, not for noise.
    """
    with atomic_write(path) as scratch:
        pq.write_table(pa.concat_tables(tables), scratch, use_dictionary=dictionary)


def column_names(path: Path) -> list[str]:
    """Return the column names of a file."""
    try:
        return list(pq.read_schema(path).names)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Read columns of numbers."""
    try:
        with pq.ParquetFile(path) as file:
            missing = set(names) - set(file.schema_arrow.names)
            if missing:
                raise BiogripError(f"{path}: has no column {min(missing)}.")
            table = file.read(columns=list(names))
        return {
            name: np.concatenate([_values(chunk) for chunk in table[name].chunks]) for name in names
        }
    except (OSError, TypeError, ValueError) as error:
        # Arrow's exceptions are subclasses of these.
        raise BiogripError(f"{path}: cannot be read: {error}.") from error


def _numbers(values: NDArray[Any]) -> pa.Array:
    kept = np.ascontiguousarray(values)
    buffers = [None, pa.py_buffer(kept)]
    return pa.Array.from_buffers(pa.from_numpy_dtype(kept.dtype), len(kept), buffers)


def _values(chunk: pa.Array) -> NDArray[Any]:
    if chunk.null_count:
        raise ValueError(f"{chunk.null_count} values are missing")
    whole = np.frombuffer(chunk.buffers()[1], dtype=chunk.type.to_pandas_dtype())
    return whole[chunk.offset : chunk.offset + len(chunk)]


def _words(text: str, rows: int) -> pa.Array:
    encoded = text.encode()
    ends = np.arange(rows + 1, dtype=np.int32) * np.int32(len(encoded))
    return pa.StringArray.from_buffers(rows, pa.py_buffer(ends), pa.py_buffer(encoded * rows))


TARGET_COLUMNS = ("time_s", "torque_Nm", "rotation_rad", "jaw_force_N")

_WITHOUT_JAWS = {
    ("time_s", each.controlled.column, each.read.column)
    for each in INSTRUMENTS.values()
    if not each.has_jaws
}

# Prefix of a seed's column.
_SEED = "seed_"
# Columns that are there if they are known, with the fields that they are of.
_KNOWN = {"target": "target_rad", "sd": "sd_rad"}
_READ_AT_ONCE = 50
_DIGITS = 9
_WRITTEN = f"{{:.{_DIGITS - 1}e}}"


@dataclass(frozen=True)
class Measurements:
    """Noisy traces of one case."""

    time_s: Array
    """Sampling instants, ascending, (n_samples,)."""
    target_rad: Array | None
    """Trace without noise, (n_samples,); None for a recorded trace."""
    rotation_rad: dict[int, Array]
    """Noisy trace of each seed, (n_samples,) each."""
    gaps: int = 0
    """Number of rows of a recording that were left out for want of a number."""
    sd_rad: Array | None = None
    """Standard deviations of the readings, (n_samples,), where they are known."""
    suspicion: str | None = None
    """Sentence on a rotation of a recording that is hardly plausible."""
    onset_s: float | None = None
    """Time of a recording's clock from which the sampling instants count, if it was given."""
    at_steps: int = 0
    """Number of readings of a recording that were left out, for they are at the instant of a step
    of a load or a deformation."""
    recognised: Recognised | None = None
    """What was recognised in the file of a recording."""


def write_target(
    path: Path, time_s: Array, torque_Nm: Array, rotation_rad: Array, jaw_force_N: Array
) -> None:
    """Write a noise-free trace of the gripper as CSV.

    Numbers have nine significant digits: more than any instrument gives, and few enough that
    results on different processors agree. The force has these digits of its largest value, since
    values near its zeros are rounding errors.
    """
    largest = float(np.max(np.abs(jaw_force_N)))
    digit = 10.0 ** (math.floor(math.log10(largest)) + 1 - _DIGITS) if largest else 1.0
    force = np.round(jaw_force_N / digit) + 0.0
    samples = zip(time_s, torque_Nm, rotation_rad, force * digit, strict=True)
    rows = (
        (f"{t:.10g}", f"{torque:.10g}", _WRITTEN.format(phi), _WRITTEN.format(f))
        for t, torque, phi, f in samples
    )
    write_rows(path, TARGET_COLUMNS, rows)


def write_target_without_jaws(
    path: Path, time_s: Array, controlled: Array, read: Array, instrument: Instrument
) -> None:
    """Write a noise-free trace of another instrument, as `write_target` does."""
    rows = (
        (f"{t:.10g}", f"{x:.10g}", _WRITTEN.format(y))
        for t, x, y in zip(time_s, controlled, read, strict=True)
    )
    write_rows(path, ("time_s", instrument.controlled.column, instrument.read.column), rows)


def as_written(rotation_rad: Array) -> Array:
    """Return a rotation rounded like a target that was written and read."""
    return np.array([float(_WRITTEN.format(value)) for value in rotation_rad])


def read_target(path: Path) -> tuple[Array, Array, Array]:
    """Read time, what is held and what is read of a target, all of them finite."""
    time_s, torque, rotation, *_ = _target_columns(path)
    return time_s, torque, rotation


def read_jaw_force(path: Path) -> tuple[Array, Array, Array]:
    """Read time, torque and jaw force of a target."""
    time_s, torque, _, force = _target_columns(path)
    return time_s, torque, force


def _target_columns(path: Path) -> Array:
    try:
        with path.open() as stream:
            header = tuple(stream.readline().strip().split(","))
            if header != TARGET_COLUMNS and header not in _WITHOUT_JAWS:
                raise BiogripError(
                    f"{path}, line 1: found the columns {', '.join(header)}; "
                    f"a target has {', '.join(TARGET_COLUMNS)}."
                )
            values = np.loadtxt(stream, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as a target: {error}.") from error
    if values.shape[1] != len(header):
        allowed = f"allowed are {len(header)}"
        raise BiogripError(
            f"{path}: found {counted(values.shape[1], 'column')} in the rows, {allowed}."
        )
    for row, column in np.argwhere(~np.isfinite(values))[:1]:
        raise BiogripError(
            f"{path}, line {row + 2}, {header[column]}: found {values[row, column]}, "
            "allowed is a finite number."
        )
    return values.T


def write_measurements(path: Path, measurements: Measurements) -> None:
    """Write noisy traces as Parquet: time_s, target and sd if known, then seed_0, ..."""
    columns = {"time_s": measurements.time_s}
    for name, field in _KNOWN.items():
        if (known := getattr(measurements, field)) is not None:
            columns[name] = known
    columns |= {f"{_SEED}{seed}": trace for seed, trace in measurements.rotation_rad.items()}
    table = table_of(columns, len(measurements.time_s))
    write_tables(path, [table], dictionary=False)


def read_measurements(path: Path, seeds: list[int] | None = None) -> Measurements:
    """Read noisy traces of all or of given seeds, which it must have."""
    present = column_names(path)
    kept = ["time_s", *(name for name in _KNOWN if name in present)]
    names = present if seeds is None else [*kept, *(f"{_SEED}{seed}" for seed in seeds)]
    columns = read_columns(path, names)
    time_s, target, sd_rad = (columns.pop(name, None) for name in ("time_s", *_KNOWN))
    assert time_s is not None
    traces = {int(name.removeprefix(_SEED)): trace for name, trace in columns.items()}
    return Measurements(time_s, target, traces, sd_rad=sd_rad)


def seeds_in(path: Path) -> list[int]:
    """Return the seeds whose noisy traces are in a file of `write_measurements`."""
    return [int(name.removeprefix(_SEED)) for name in column_names(path) if name.startswith(_SEED)]


def each_trace(path: Path) -> Iterator[Array]:
    """Yield the noisy traces in a file, (n_samples,) each, reading some at once."""
    seeds = seeds_in(path)
    for some in parts(len(seeds), _READ_AT_ONCE):
        yield from read_measurements(path, seeds[some]).rotation_rad.values()
