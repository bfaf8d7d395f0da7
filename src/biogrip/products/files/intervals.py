"""Estimates with intervals: a row per quantity and seed."""

from biogrip.products.files.rows import RowFile

INTERVALS = RowFile(
    "intervals",
    ("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
    "results/coverage/{case}.csv",
    "results/coverage/{case}/{batch}.csv",
)
