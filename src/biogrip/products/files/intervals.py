"""Estimates with intervals: a row per quantity and seed.

Of quantities that traces should determine an estimate and its limits, and the estimate with
the rest known. Of every so many seeds, and there of all quantities, verdict and limits as shown
to users, which come from whole profiles.
"""

from biogrip.products.files.rows import RowFile

INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
        *("verdict", "shown_low", "shown_high"),
    ),
    "results/coverage/{case}.csv",
    "results/coverage/{case}/{batch}.csv",
    words=("verdict",),
)
