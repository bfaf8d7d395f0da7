"""Export of a single noisy trace as CSV in the format of recorded traces."""

from pathlib import Path

from biogrip.products.product import Product, Reads
from biogrip.products.uses import from_case
from biogrip.records.traces import (
    MEASUREMENTS,
    SINGLE_TRACES,
    read_measurements,
    write_single_trace,
)
from biogrip.study.study import Case


def export(case: Case, seed: int, measurements: Path, trace: Path) -> None:
    """Write the trace of one seed as CSV, from measurements in Parquet."""
    recorded = read_measurements(measurements, [seed])
    column = case.instrument.read.column
    write_single_trace(trace, recorded.time_s, recorded.rotation_rad[seed], column)


SINGLE_TRACE = Product(
    "single_trace",
    {"trace": SINGLE_TRACES},
    export,
    from_case("instrument"),
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
