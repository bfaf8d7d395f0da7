"""Export of a single noisy trace as CSV in the format of recorded traces."""

from pathlib import Path

from biogrip.products.files.traces import (
    MEASUREMENTS,
    SINGLE_TRACES,
    read_measurements,
    write_single_trace,
)
from biogrip.products.product import Product, Reads


def export(settings: None, seed: int, measurements: Path, trace: Path) -> None:
    """Write the trace of one seed as CSV, from measurements in Parquet."""
    recorded = read_measurements(measurements, [seed])
    write_single_trace(trace, recorded.time_s, recorded.rotation_rad[seed])


SINGLE_TRACE = Product(
    "single_trace",
    {"trace": SINGLE_TRACES},
    export,
    lambda study, job: None,
    lambda plan: [],
    message="Writing trace {seed} of {case} as CSV",
    reads={
        "measurements": Reads(
            lambda plan, job: [plan.batch_of_seed(MEASUREMENTS, job["case"], int(job["seed"]))],
            one=True,
        )
    },
    by_default=False,
)
