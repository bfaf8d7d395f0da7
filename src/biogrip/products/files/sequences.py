"""Sequences of experiments with a simulated cell: a row per way, number of experiments, quantity.

Best fit and limits of all traces so far together; whether a fit that starts at the truth goes
deeper; and whether the jaws have pressed the cell throughout.
"""

from biogrip.products.files.rows import RowFile

SEQUENCES = RowFile(
    "a sequence of experiments",
    (
        *("case", "cell", "way", "experiments", "quantity"),
        *("truth", "estimate", "low", "high", "missed", "pressed"),
    ),
    "results/sequences/{case}/cell_{seed}.csv",
    words=("way", "quantity"),
)
