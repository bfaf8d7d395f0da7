"""Estimates with intervals: a row per quantity and seed.

Quantities that traces should determine have an estimate, its limits, and the estimate with
uninformed parameters fixed at their true values. For some seeds, all quantities also have the
verdict and limits that users are shown, from whole profiles.
"""

from biogrip.records.rows import RowFile

INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
        *("verdict", "shown_low", "shown_high"),
    ),
    "results/coverage/{case}/{batch}.csv",
    words=("verdict",),
)
