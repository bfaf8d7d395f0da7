"""Identifications by the genetic algorithm, a row for each interpretation of the paper and seed."""

from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.records.rows import RowFile

INTERPRETATIONS = RowFile(
    "interpretations",
    (
        "case",
        "interpretation",
        "seed",
        *(parameter.column for parameter in SINGLE_BRANCH),
        "misfit",
        "noise_rms",
        "last_improvement",
    ),
    "results/interpretations/{case}.csv",
    words=("interpretation",),
)
