"""Identifications as rows of a file."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from biogrip.files import written_whole
from biogrip.identify.genetic import Identification
from biogrip.sample import ALL_PARAMETERS, SampleModel

PARAMETER_COLUMNS = tuple(parameter.column for parameter in ALL_PARAMETERS)

COLUMNS = (
    "case",
    "method",
    "seed",
    *PARAMETER_COLUMNS,
    "misfit_rad",
    "noise_rms_rad",
    "generations",
    "evaluations",
    "stop_reason",
)


@dataclass(frozen=True)
class Record:
    """One identification and whose it is.

    Parameters
    ----------
    case, method, seed
        Whose it is.
    model
        Sample model that was identified.
    answer
        What came out.
    noise_rms_rad
        RMS of the noise that the trace really contains.
    """

    case: str
    method: str
    seed: int
    model: SampleModel
    answer: Identification
    noise_rms_rad: float


def write_identifications(path: Path, records: list[Record]) -> None:
    """Write one row a seed as CSV; elements that the model lacks are 0."""
    with written_whole(path) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for record in records:
            answer = record.answer
            values = dict(zip(record.model.names, answer.parameters, strict=True))
            writer.writerow(
                (
                    record.case,
                    record.method,
                    record.seed,
                    *(f"{values.get(p.name, 0.0):.10g}" for p in ALL_PARAMETERS),
                    f"{answer.misfit_rad:.6e}",
                    f"{record.noise_rms_rad:.6e}",
                    answer.generations,
                    answer.evaluations,
                    answer.stop_reason,
                )
            )


def write_histories(path: Path, records: list[Record]) -> None:
    """Write one row a seed and generation as Parquet."""
    with written_whole(path) as scratch:
        pq.write_table(pa.concat_tables([_history(record) for record in records]), scratch)


def _history(record: Record) -> pa.Table:
    history = record.answer.history
    generations = len(history.best_misfit)
    values = dict(zip(record.model.names, history.best_parameters.T, strict=True))
    return pa.table(
        {
            "case": pa.array([record.case] * generations, pa.string()),
            "method": pa.array([record.method] * generations, pa.string()),
            "seed": np.full(generations, record.seed, dtype=np.int64),
            "generation": np.arange(generations, dtype=np.int64),
            "evaluations": history.evaluations,
            "best_misfit_rad": history.best_misfit,
            "median_misfit_rad": history.median_misfit,
            **{p.column: values.get(p.name, np.zeros(generations)) for p in ALL_PARAMETERS},
        }
    )
