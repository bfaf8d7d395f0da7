"""Results of stages: what was identified, a row a seed, and verdicts on a trace, JSON.

Identifications by each method have a row per seed, with histories beside them. Further files of
rows have the fits of every sample model, the intervals of coverage tests, and identifications under
other readings of the paper.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import significant
from biogrip.fit.problem import Fit
from biogrip.physics.sample_model import SINGLE_BRANCH, Parameter, SampleModel
from biogrip.records.rows import (
    RowFile,
    join_arrays,
    read_arrays,
    read_object,
    seeds_of,
    write_arrays,
    write_rows,
)
from biogrip.study.study import Case

if TYPE_CHECKING:
    import pandas as pd

# Few enough that results on different processors agree.
_DIGITS = 8

LEADING = ("case", "method", "seed")
TRAILING = ("misfit", "noise_rms", "generations", "evaluations", "stop_reason")
ENCODABLE = "encodable_misfit"
"""Last column of the identifications of a case: lowest misfit that genes can encode of the
trace, see `lowest_encodable`; empty if it was recorded."""

MODEL_FITS = RowFile(
    "fits of models",
    ("case", "model", "seed", "parameters", "samples", "misfit"),
    words=("case", "model"),
)

INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
        *("verdict", "shown_low", "shown_high"),
    ),
    words=("case", "quantity", "verdict"),
)
"""A row per quantity and seed. Quantities that traces should determine have an estimate, its
limits, and the estimate with uninformed parameters fixed at their true values. For some seeds, all
quantities also have the verdict and limits that users are shown, from whole profiles."""

READINGS = RowFile(
    "readings",
    (
        *("case", "reading", "seed"),
        *(parameter.column for parameter in SINGLE_BRANCH),
        *("misfit", "noise_rms", "generations", "last_improvement"),
    ),
    words=("case", "reading"),
)


def read_readings(path: Path, case: Case) -> "pd.DataFrame":
    """Read what every reading found of a case, in all seeds; parameters stand by name."""
    names, seeds = case.study.config.readings, range(case.seeds)
    found = READINGS.read(path, case=[case.name], reading=names, seed=seeds)
    return found.rename(columns={p.column: p.name for p in SINGLE_BRANCH})


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
    answer: Fit
    noise_rms: float | None
    """RMS of the noise in the trace; None for a recorded trace."""

    def by_column(self, identified: Array) -> dict[str, Any]:
        """Return identified values, (n_searched, ...), fixed ones, and 0 for missing elements."""
        values = {**self.fixed, **dict(zip(self.searched.names, identified, strict=True))}
        return {p.column: values.get(p.name, 0.0) for p in parameters_in_file(self.model)}


def write_identifications(path: Path, records: list[Record]) -> None:
    """Write one row per seed as CSV.

    Numbers have six significant digits: more than a trace determines, and few enough that
    results on different processors agree.
    """
    rows = (
        (
            *(record.case, record.method, record.seed),
            *(f"{value:.6g}" for value in record.by_column(record.answer.parameters).values()),
            f"{record.answer.misfit:.6e}",
            "" if record.noise_rms is None else f"{record.noise_rms:.6e}",
            *(record.answer.generations, record.answer.evaluations, record.answer.stop_reason),
        )
        for record in records
    )
    write_rows(path, columns(records[0].model), rows)


def write_histories(path: Path, records: list[Record]) -> None:
    """Write columns of a row per seed and generation as npz, with eight significant digits."""
    write_arrays(path, join_arrays([_history(record) for record in records]))


def _history(record: Record) -> dict[str, Array]:
    history = record.answer.history
    generations = len(history.best_misfit)
    found = {
        "best_misfit": history.best_misfit,
        "median_misfit": history.median_misfit,
        **record.by_column(history.best_parameters.T),
    }
    return {
        "method": np.full(generations, record.method),
        "seed": np.full(generations, record.seed),
        "generation": np.arange(generations),
        "evaluations": np.asarray(history.evaluations),
        **{
            name: significant(np.broadcast_to(values, generations), _DIGITS)
            for name, values in found.items()
        },
    }


def read_identifications(path: Path, case: Case, method: str | None = None) -> "pd.DataFrame":
    """Read identifications of a case by all methods of the study, or by one, in all seeds."""
    frame = _read(path, case, case.study.config.methods, range(case.seeds))
    return frame if method is None else frame[frame["method"] == method].reset_index(drop=True)


def read_batch(path: Path, case: Case) -> "pd.DataFrame":
    """Read identifications by the method and in the seeds that the path of a batch names."""
    return _read(path, case, [path.parent.name], seeds_of(path.stem))


def _read(path: Path, case: Case, methods: Sequence[str], seeds: range) -> "pd.DataFrame":
    file = RowFile("identifications", columns(case.sample.model), ("case", "method", "stop_reason"))
    return file.read(path, case=[case.name], method=methods, seed=seeds)


def read_histories(path: Path, method: str, values: Sequence[str]) -> "pd.DataFrame":
    """Read columns of one method's histories."""
    import pandas as pd

    frame = pd.DataFrame(read_arrays(path))
    kept = frame["method"] == method
    return frame.loc[kept, ["seed", "generation", *values]].reset_index(drop=True)


def read_verdicts(path: Path) -> dict[str, Any]:
    """Read a file of verdicts."""
    return read_object(path, "verdicts")
