"""Identified parameters, histories and processor times: a row per seed and method.

Misfit of each sample model: a row per model and seed.

Estimates with intervals: a row per quantity and seed.

Quantities that traces should determine have an estimate, its limits, and the estimate with
uninformed parameters fixed at their true values. For some seeds, all quantities also have the
verdict and limits that users are shown, from whole profiles.

Difference of the linear from the nonlinear model: a row per case, angle and torque.

Identifications by the genetic algorithm, a row for each interpretation of the paper and seed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import significant
from biogrip.errors import BiogripError
from biogrip.fit.problem import Identification
from biogrip.physics.sample_model import SINGLE_BRANCH, Parameter, SampleModel
from biogrip.records.rows import RowFile, read_frame, write_rows
from biogrip.records.traces import Table, table_of, write_tables

if TYPE_CHECKING:
    import pandas as pd

# Few enough that results on different processors agree.
_DIGITS = 8

TIMINGS = RowFile(
    "processor times",
    ("case", "method", "seed", "cpu_s"),
    "results/timings/{case}/{method}/{batch}.csv",
)
"""Processor time of each seed, in a file of its own since times are not reproducible."""

LEADING = ("case", "method", "seed")
TRAILING = ("misfit", "noise_rms", "generations", "evaluations", "stop_reason")


def parameters_in_file(model: SampleModel) -> tuple[Parameter, ...]:
    """Return the parameters that have columns in a file of identifications.

    They are the paper's four, in its units, if these cover the model, with 0 for missing elements,
    so that files can be concatenated. Otherwise they are the model's own.
    """
    covered = {p.column for p in model.parameters} <= {p.column for p in SINGLE_BRANCH}
    return SINGLE_BRANCH if covered else model.parameters


def columns(model: SampleModel) -> tuple[str, ...]:
    """Return the columns of a file of identifications."""
    return (*LEADING, *(p.column for p in parameters_in_file(model)), *TRAILING)


@dataclass(frozen=True)
class Record:
    """One identification, with case, method and seed."""

    case: str
    method: str
    model: SampleModel
    searched: SampleModel
    """The model without fixed parameters."""
    fixed: Mapping[str, float]
    """Values of fixed parameters by name."""
    seed: int
    """Seed of the trace."""
    answer: Identification
    noise_rms: float | None
    """RMS of the noise in the trace; None for a recorded trace."""
    cpu_s: float
    """Processor time in seconds; the mean over seeds that are identified together."""


def write_identifications(path: Path, records: list[Record]) -> None:
    """Write one row per seed as CSV; elements that the model lacks are 0.

    Numbers have six significant digits: more than a trace determines, and few enough that
    results on different processors agree.
    """
    write_rows(path, columns(records[0].model), map(_row, records))


def write_histories(path: Path, records: list[Record]) -> None:
    """Write one row per seed and generation as Parquet, with eight significant digits."""
    write_tables(path, [_history(record) for record in records])


def write_timings(path: Path, records: list[Record]) -> None:
    """Write the processor time of each seed as CSV."""
    TIMINGS.write(path, ((r.case, r.method, r.seed, f"{r.cpu_s:.6f}") for r in records))


def read_identifications(path: Path, method: str | None = None) -> "pd.DataFrame":
    """Read identifications by all methods or by one, of which there must be some."""
    frame = read_frame(path, "identifications", (*LEADING, *TRAILING))
    if method is None:
        return frame
    chosen = frame[frame["method"] == method].reset_index(drop=True)
    if chosen.empty:
        raise BiogripError(f"{path}: holds no identification by {method}.")
    return chosen


def read_histories(
    path: Path,
    method: str,
    values: Sequence[str],
    chosen: "Callable[[pd.Series[int]], pd.Series[bool]]" = lambda seed: seed >= 0,
) -> "pd.DataFrame":
    """Read columns of one method's histories of the chosen seeds, Parquet.

    Raises
    ------
    BiogripError
        If the file cannot be read.
    """
    import pandas as pd
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = ["seed", "generation", *values]
    try:
        # Import of pandas' own Parquet reader would take a tenth of the memory.
        with pq.ParquetFile(path, read_dictionary=["method"]) as file:
            groups = (
                file.read_row_group(group, ["method", *columns]).to_pandas()
                for group in range(file.num_row_groups)
            )
            parts = [rows[chosen(rows["seed"]) & (rows["method"] == method)] for rows in groups]
        return pd.concat(parts, ignore_index=True)[columns]
    except (KeyError, OSError, TypeError, ValueError, pa.ArrowException) as error:
        raise BiogripError(f"{path}: cannot be read as histories: {error}.") from error


def _row(record: Record) -> tuple[str | int, ...]:
    answer = record.answer
    values = _by_name(record, answer.parameters)
    return (
        record.case,
        record.method,
        record.seed,
        *(f"{values.get(p.name, 0.0):.6g}" for p in parameters_in_file(record.model)),
        f"{answer.misfit_rad:.6e}",
        "" if record.noise_rms is None else f"{record.noise_rms:.6e}",
        answer.generations,
        answer.evaluations,
        answer.stop_reason,
    )


def _by_name(record: Record, identified: Array) -> dict[str, Any]:
    """Return identified and fixed values by parameter name."""
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
            "best_misfit": significant(history.best_misfit, _DIGITS),
            "median_misfit": significant(history.median_misfit, _DIGITS),
            **{
                p.column: significant(
                    np.broadcast_to(values.get(p.name, 0.0), generations), _DIGITS
                )
                for p in parameters_in_file(record.model)
            },
        },
        generations,
    )


MODEL_FITS = RowFile(
    "fits of models",
    ("case", "model", "seed", "parameters", "samples", "misfit"),
    "results/selection/{case}/{batch}.csv",
)


INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
        *("verdict", "shown_low", "shown_high"),
    ),
    "results/coverage/{case}/{batch}.csv",
    words=("verdict",),
)


DIFFERENCES = RowFile(
    "a comparison",
    ("case", "reference_angle_deg", "torque_factor", "difference_over_peak"),
    "results/linearisation.csv",
)


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
