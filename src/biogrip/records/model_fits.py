"""Misfit of each sample model: a row per model and seed."""

from biogrip.records.rows import RowFile

MODEL_FITS = RowFile(
    "fits of models",
    ("case", "model", "seed", "parameters", "samples", "misfit"),
    "results/selection/{case}/{batch}.csv",
)
