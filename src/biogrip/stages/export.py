"""A single noisy trace as CSV, in the form in which recorded traces are read."""

import csv
from pathlib import Path

from biogrip.files import written_whole
from biogrip.traces import read_measurements

COLUMNS = ("time_s", "rotation_rad")


def run(seed: int, measurements: Path, output: Path) -> None:
    """Write the trace of one seed.

    Parameters
    ----------
    seed
        Which one.
    measurements
        Noisy traces, Parquet.
    output
        The trace, CSV.

    Raises
    ------
    BiogripError
        If the measurements cannot be read, or lack the seed.
    """
    recorded = read_measurements(measurements, [seed])
    with written_whole(output) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for t, phi in zip(recorded.time_s, recorded.rotation_rad[seed], strict=True):
            writer.writerow((f"{t:.10g}", f"{phi:.6e}"))
