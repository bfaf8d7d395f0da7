"""Identifications by the genetic algorithm under readings of the paper: a row per reading, seed."""

from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.products.files.rows import RowFile

READINGS = RowFile(
    "readings",
    (
        "case",
        "reading",
        "seed",
        *(parameter.column for parameter in SINGLE_BRANCH),
        "misfit_rad",
        "noise_rms_rad",
        "last_improvement",
    ),
    "results/readings/{case}.csv",
    words=("reading",),
)
