"""Runs the comparison and writes `benchmarks/field/results`."""

import os
import sys

# One thread for every competitor. Libraries read this once, while they are imported.
for variable in (
    "BLIS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
):
    os.environ[variable] = "1"
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

if __name__ == "__main__":
    from benchmarks.field.report import run

    run(sys.argv[1:])
