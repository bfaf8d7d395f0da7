"""Sequences of experiments with a simulated cell: a row per way, number of experiments, quantity.

A row has the best fit and limits from all traces so far together, 1 if a fit started at the truth
has a lower chi^2 (missed), and 1 if the jaws pressed the cell throughout.
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
