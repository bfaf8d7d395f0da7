"""Files of targets, CSV, and of measurements, npz: traces without and with noise."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import AGAIN, whole, write_rows
from biogrip.physics.instruments import Instrument
from biogrip.traces.reader import Recording
from biogrip_study.records.rows import read_arrays, write_arrays

# More than any instrument gives, and few enough that results on different processors agree.
_TARGET_DIGITS = 9
_WRITTEN = f"{{:.{_TARGET_DIGITS - 1}e}}"


# What else is known of a recorded trace, as `Recording` names it, and how it is read back.
_OF_RECORDINGS: Mapping[str, Callable[[Any], Any]] = {
    "sd": np.asarray,
    "correlation": np.asarray,
    "sd_known": bool,
    "onset_s": float,
    "remarks_before": tuple,
}


@dataclass(frozen=True)
class Measurements:
    """Noisy traces of one case."""

    time_s: Array
    """Sampling instants, ascending, (n_samples,)."""
    target: Array | None
    """Trace without noise, (n_samples,); None for a recorded trace."""
    readings: dict[int, Array]
    """Noisy trace of each seed, (n_samples,) each."""
    known: Mapping[str, Any] = field(default_factory=dict)
    """What else is known of a recorded trace, as `Recording` names it."""

    @property
    def recording(self) -> Recording:
        """The only trace, a recorded one."""
        (readings,) = self.readings.values()
        return Recording(self.time_s, readings, np.arange(len(readings)), **self.known)


def measurements_of(recording: Recording) -> Measurements:
    """Return a recorded trace as the only one of its case."""
    known = {name: getattr(recording, name) for name in _OF_RECORDINGS}
    known = {name: value for name, value in known.items() if value is not None}
    return Measurements(recording.time_s, None, {0: recording.readings}, known)


def write_target(
    path: Path,
    instrument: Instrument,
    time_s: Array,
    controlled: Array,
    read: Array,
    jaw_force_N: Array | None = None,
) -> None:
    """Write a noise-free trace as CSV, all arrays (n_samples,), with the force if there are jaws.

    Numbers have nine significant digits. The force has these of its largest value, since values
    near its zeros are rounding errors.
    """
    columns = ["time_s", instrument.controlled.column, instrument.read.column]
    simulated = [read]
    if jaw_force_N is not None:
        largest = float(np.max(np.abs(jaw_force_N)))
        digit = 10.0 ** (math.floor(math.log10(largest)) + 1 - _TARGET_DIGITS) if largest else 1.0
        columns.append("jaw_force_N")
        simulated.append((np.round(jaw_force_N / digit) + 0.0) * digit)
    rows = (
        (f"{t:.10g}", f"{x:.10g}", *map(_WRITTEN.format, values))
        for t, x, *values in zip(time_s, controlled, *simulated, strict=True)
    )
    write_rows(path, columns, rows)


def read_target(path: Path, times_s: Array) -> tuple[Array, Array, Array]:
    """Read time, what is controlled and what is read of a target, of just the times given, (n,)."""
    # Without pandas, which most jobs that read a target do not import.
    lines = whole(path, "a target").splitlines()[1:]
    try:
        values = np.loadtxt(lines or ["nan,nan,nan"], delimiter=",", usecols=(0, 1, 2), ndmin=2)
    except ValueError as error:
        raise BiogripError(f"{path}: cannot be read as a target: {error}. {AGAIN}") from error
    time_s, controlled, read = values.T
    if [*time_s] != [float(f"{t:.10g}") for t in times_s]:
        text = f"found {len(lines)} readings, wanted {len(times_s)} at the times of the config"
        raise BiogripError(f"{path}: {text}. {AGAIN}")
    return time_s, controlled, read


def write_measurements(path: Path, measurements: Measurements) -> None:
    """Write noisy traces as npz: time_s, seeds, traces in their order, and what else is known."""
    arrays = {
        "time_s": measurements.time_s,
        "seeds": list(measurements.readings),
        "traces": list(measurements.readings.values()),
        **measurements.known,
    }
    if measurements.target is not None:
        arrays["target"] = measurements.target
    write_arrays(path, arrays)


def read_measurements(path: Path, seeds: list[int] | None = None) -> Measurements:
    """Read noisy traces of all or of given seeds, which it must have."""
    arrays = read_arrays(path)
    traces = dict(zip(arrays["seeds"].tolist(), arrays["traces"], strict=True))
    if missing := set(seeds or ()) - set(traces):
        raise BiogripError(f"{path}: has no trace of seed {min(missing)}.")
    chosen = traces if seeds is None else {seed: traces[seed] for seed in seeds}
    known = {name: kind(arrays[name]) for name, kind in _OF_RECORDINGS.items() if name in arrays}
    return Measurements(arrays["time_s"], arrays.get("target"), chosen, known)
