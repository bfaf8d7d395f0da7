"""Runs all benchmarks and writes `benchmarks/results`."""

from pathlib import Path

from benchmarks.one_thread import keep_to_one_thread

if __name__ == "__main__":
    keep_to_one_thread()
    from benchmarks.identification import IDENTIFICATION
    from benchmarks.local_fits import LOCAL_FITS
    from benchmarks.misfit import MISFIT
    from benchmarks.report import Report

    Report(
        Path(__file__).parent / "results" / "benchmarks",
        """\
# Benchmarks

Written by `make bench`, all of it in one run. All competitors run in one process on one thread and
take turns, so that a slow moment strikes them all. Times are medians; ratios are taken turn by
turn, and given as their median with the lowest and the highest.""",
        (MISFIT, IDENTIFICATION, LOCAL_FITS),
        ("deap", "lmfit", "pygad", "pymoo"),
    ).run()
