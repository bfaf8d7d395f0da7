"""Runs the comparisons on measured traces and on a sweep and writes `benchmarks/field/results`."""

from pathlib import Path

from benchmarks.one_thread import keep_to_one_thread

if __name__ == "__main__":
    keep_to_one_thread()
    from benchmarks.field.measured import BIOGRIP, PYRHEO, section
    from benchmarks.field.measured_peers import PEERS
    from benchmarks.field.sweeps import REPORT
    from benchmarks.report import Report

    Report(
        Path(__file__).parent / "results" / "field",
        "# Beside what the field uses\n\nWritten by `make bench-field`, all of it in one run.",
        (section((BIOGRIP, *PEERS, PYRHEO)),),
        ("lmfit", "rheojax", "nlsq", "jax"),
    ).run()
    REPORT.run()
