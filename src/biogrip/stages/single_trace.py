"""Export of a single noisy trace as CSV in the format of recorded traces."""

from pathlib import Path

from biogrip.records.traces import (
    read_measurements,
    write_single_trace,
)
from biogrip.study.study import Case


def export(case: Case, seed: int, measurements: Path, trace: Path) -> None:
    """Write the trace of one seed as CSV, from measurements in Parquet."""
    recorded = read_measurements(measurements, [seed])
    column = case.instrument.read.column
    write_single_trace(trace, recorded.time_s, recorded.rotation_rad[seed], column)
