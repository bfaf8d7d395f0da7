"""Identifications as rows of a file."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.files import written_whole
from biogrip.identify.answer import Identification
from biogrip.parquet import Table, table_of, write_tables
from biogrip.sample import SINGLE_BRANCH, Parameter, SampleModel

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
    case, method, seed
        Whose it is.
    model, searched, fixed
        Sample model; the same without the parameters that were not identified;
        and those, by name.
    answer
        What came out.
    noise_rms_rad
        RMS of the noise that the trace really contains; None if nobody knows.
    cpu_s
        Processor time that it took; its share of those identified side by side with it.
    """

    case: str
    method: str
    seed: int
    model: SampleModel
    searched: SampleModel
    fixed: dict[str, float]
    answer: Identification
    noise_rms_rad: float | None
    cpu_s: float


def write_identifications(path: Path, records: list[Record]) -> None:
    """Write one row a seed as CSV; elements that the model lacks are 0.

    Six significant digits are more than any trace determines, and fewer than those
    in which two processors' optima differ.
    """
    with written_whole(path) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns(records[0].model))
        for record in records:
            answer = record.answer
            values = _by_name(record, answer.parameters)
            writer.writerow(
                (
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
            )


def write_histories(path: Path, records: list[Record]) -> None:
    """Write one row a seed and generation as Parquet."""
    write_tables(path, [_history(record) for record in records])


def write_timings(path: Path, records: list[Record]) -> None:
    """Write the processor time of each seed as CSV, apart from what is compared."""
    with written_whole(path) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("case", "method", "seed", "cpu_s"))
        for record in records:
            writer.writerow((record.case, record.method, record.seed, f"{record.cpu_s:.6f}"))


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
            "best_misfit_rad": history.best_misfit,
            "median_misfit_rad": history.median_misfit,
            **{
                p.column: np.broadcast_to(values.get(p.name, 0.0), generations)
                for p in parameters_in_file(record.model)
            },
        },
        generations,
    )
