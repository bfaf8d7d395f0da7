"""Runs every benchmark, or those named, and writes `benchmarks/results`."""

import os
import sys

# One thread for every competitor. BLAS libraries read this once, while numpy is imported.
for variable in (
    "BLIS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
):
    os.environ[variable] = "1"

if __name__ == "__main__":
    from benchmarks.report import run

    run(sys.argv[1:])
