"""What was identified, how it was found, and what it took: a row a seed, method by method."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import significant
from biogrip.errors import BiogripError
from biogrip.experiment.sample import SINGLE_BRANCH, Parameter, SampleModel
from biogrip.identify.answer import Identification
from biogrip.products.files.parquet import Table, table_of, write_tables
from biogrip.products.files.rows import RowFile, read_frame, write_rows

if TYPE_CHECKING:
    import pandas as pd

# Fewer than those in which two processors' ways to an optimum differ.
_DIGITS = 8

PATH = "results/identifications/{case}.csv"
BATCHES = "results/identifications/{case}/{method}/{batch}.csv"
HISTORIES = "results/histories/{case}.parquet"
HISTORY_BATCHES = "results/histories/{case}/{method}/{batch}.parquet"

TIMINGS = RowFile(
    "processor times",
    ("case", "method", "seed", "cpu_s"),
    "results/timings/{case}.csv",
    "results/timings/{case}/{method}/{batch}.csv",
)
"""Processor time of each seed, apart from what is compared."""

LEADING = ("case", "method", "seed")
TRAILING = ("misfit_rad", "noise_rms_rad", "generations", "evaluations", "stop_reason")


def parameters_in_file(model: SampleModel) -> tuple[Parameter, ...]:
    """Parameters that a file of identifications has columns for.

    The paper's four wherever they cover the model, elements that it lacks being
    zero, so that such files can be put together; else the model's own.
    """
    return (
        SINGLE_BRANCH if set(model.names) <= {p.name for p in SINGLE_BRANCH} else model.parameters
    )


def columns(model: SampleModel) -> tuple[str, ...]:
    """Columns of a file of identifications."""
    return (*LEADING, *(p.column for p in parameters_in_file(model)), *TRAILING)


@dataclass(frozen=True)
class Record:
    """One identification and whose it is.

    Parameters
    ----------
    case, method
        Whose it is.
    model, searched, fixed
        Sample model; the same without the parameters that were not identified;
        and those, by name.
    seed
        Of which trace.
    answer
        What came out.
    noise_rms_rad
        RMS of the noise that the trace really contains; None if nobody knows.
    cpu_s
        Processor time that it took; its share of those identified side by side with it.
    """

    case: str
    method: str
    model: SampleModel
    searched: SampleModel
    fixed: Mapping[str, float]
    seed: int
    answer: Identification
    noise_rms_rad: float | None
    cpu_s: float


def write_identifications(path: Path, records: list[Record]) -> None:
    """Write one row a seed as CSV; elements that the model lacks are 0.

    Six significant digits are more than any trace determines, and fewer than those
    in which two processors' optima differ.
    """
    write_rows(path, columns(records[0].model), map(_row, records))


def write_histories(path: Path, records: list[Record]) -> None:
    """Write one row a seed and generation as Parquet, its numbers to eight significant digits."""
    write_tables(path, [_history(record) for record in records])


def write_timings(path: Path, records: list[Record]) -> None:
    """Write the processor time of each seed as CSV."""
    TIMINGS.write(path, ((r.case, r.method, r.seed, f"{r.cpu_s:.6f}") for r in records))


def read_identifications(path: Path, method: str | None = None) -> "pd.DataFrame":
    """Read a file of identifications, all of them or one method's.

    Raises
    ------
    BiogripError
        If it is missing or is not one.
    """
    frame = read_frame(path, "identifications", (*LEADING, *TRAILING))
    if method is None:
        return frame
    chosen = frame[frame["method"] == method].reset_index(drop=True)
    if chosen.empty:
        raise BiogripError(f"{path}: holds no identification by {method}.")
    return chosen


def _row(record: Record) -> tuple[str | int, ...]:
    answer = record.answer
    values = _by_name(record, answer.parameters)
    return (
        record.case,
        record.method,
        record.seed,
        *(f"{values.get(p.name, 0.0):.6g}" for p in parameters_in_file(record.model)),
        f"{answer.misfit_rad:.6e}",
        "" if record.noise_rms_rad is None else f"{record.noise_rms_rad:.6e}",
        answer.generations,
        answer.evaluations,
        answer.stop_reason,
    )


def _by_name(record: Record, identified: Array) -> dict[str, Any]:
    """Identified and fixed values by parameter name."""
    return {**record.fixed, **dict(zip(record.searched.names, identified, strict=True))}


def _history(record: Record) -> Table:
    history = record.answer.history
    generations = len(history.best_misfit)
    values = _by_name(record, history.best_parameters.T)
    return table_of(
        {
            "case": record.case,
            "method": record.method,
            "seed": np.full(generations, record.seed, dtype=np.int64),
            "generation": np.arange(generations, dtype=np.int64),
            "evaluations": history.evaluations,
            "best_misfit_rad": significant(history.best_misfit, _DIGITS),
            "median_misfit_rad": significant(history.median_misfit, _DIGITS),
            **{
                p.column: significant(
                    np.broadcast_to(values.get(p.name, 0.0), generations), _DIGITS
                )
                for p in parameters_in_file(record.model)
            },
        },
        generations,
    )
