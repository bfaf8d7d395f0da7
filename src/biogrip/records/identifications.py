"""Results of stages: what was identified, a row a seed, and verdicts on a trace, JSON.

Identifications by each method have a row per seed, with histories beside them. Further files of
rows have the fits of every sample model, the intervals of coverage tests, the difference of the
linear from the nonlinear model, and identifications under other interpretations of the paper.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import round_increase, rounded_numbers, significant
from biogrip.errors import BiogripError
from biogrip.fit.problem import Fit
from biogrip.judging.doubts import (
    REJECTED,
    REJECTION,
    Note,
    compute_status,
    find_reasons,
    order_notes,
)
from biogrip.physics.sample_model import SINGLE_BRANCH, Parameter, SampleModel
from biogrip.records.rows import (
    RowFile,
    join_arrays,
    read_arrays,
    read_frame,
    read_object,
    write_arrays,
    write_rows,
)

if TYPE_CHECKING:
    import pandas as pd

    from biogrip.judging.diagnosis import Diagnosis
    from biogrip.judging.verdicts import Finding

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
)

INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known"),
        *("verdict", "shown_low", "shown_high"),
    ),
    words=("verdict",),
)
"""A row per quantity and seed. Quantities that traces should determine have an estimate, its
limits, and the estimate with uninformed parameters fixed at their true values. For some seeds, all
quantities also have the verdict and limits that users are shown, from whole profiles."""

DIFFERENCES = RowFile(
    "a comparison",
    ("case", "reference_angle_deg", "torque_factor", "difference_over_peak"),
)

INTERPRETATIONS = RowFile(
    "interpretations",
    (
        *("case", "interpretation", "seed"),
        *(parameter.column for parameter in SINGLE_BRANCH),
        *("misfit", "noise_rms", "last_improvement"),
    ),
    words=("interpretation",),
)

FIT_REJECTED = "fit rejected"
"""Verdict on every quantity of a fit that is rejected."""


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


def read_identifications(path: Path, method: str | None = None) -> "pd.DataFrame":
    """Read identifications by all methods or by one, of which there must be some."""
    frame = read_frame(path, "identifications", (*LEADING, *TRAILING))
    if method is None:
        return frame
    chosen = frame[frame["method"] == method].reset_index(drop=True)
    if chosen.empty:
        raise BiogripError(f"{path}: holds no identification by {method}.")
    return chosen


def read_histories(path: Path, method: str, values: Sequence[str]) -> "pd.DataFrame":
    """Read columns of one method's histories."""
    import pandas as pd

    frame = pd.DataFrame(read_arrays(path))
    kept = frame["method"] == method
    return frame.loc[kept, ["seed", "generation", *values]].reset_index(drop=True)


def diagnosis_data(diagnosis: "Diagnosis", notes: Sequence[Note] = ()) -> dict[str, Any]:
    """Return a diagnosis and further notes as plain data in SI units, rounded.

    In a study the case says what is read, and no name has its unit.
    """
    data = rounded_numbers(exact_data(diagnosis, notes))
    return {key.removesuffix("_rad"): value for key, value in data.items()}


def exact_data(
    diagnosis: "Diagnosis", notes: Sequence[Note] = (), on_reading: Sequence[Note] = ()
) -> dict[str, Any]:
    """Return a diagnosis like `diagnosis_data`, with only chi^2 increases rounded.

    A rejected fit determines nothing: its quantities have the best fit as value, no limits, and
    the verdict `FIT_REJECTED`; its misfit tells no noise. Notes that neither reject it nor are on
    reading the file speak of results that it does not have, and are left out.
    """
    likelihood = diagnosis.likelihood
    every = [*diagnosis.notes, *on_reading, *notes]
    status = compute_status(every)
    rejected = status == REJECTED
    if rejected:
        every = [note for note in every if note.weight == REJECTION or note in on_reading]
    ordered = order_notes(every)
    return {
        "fit": status,
        "reasons": find_reasons(ordered),
        "samples": likelihood.problem.residuals.samples,
        "misfit_rad": likelihood.misfit,
        "noise_rad": None if rejected else likelihood.noise_sd,
        "scatter_rad": likelihood.problem.residuals.noise_scale,
        "threshold": likelihood.threshold,
        "certainty": likelihood.certainty,
        "quantities": [_finding(each, rejected=rejected) for each in diagnosis.findings],
        "hidden": [
            {"words": each.words(), "moves": each.moves}
            for each in ([] if rejected else diagnosis.hidden)
            if each.beyond[1] > 1
        ],
        "trades": [
            {
                "members": list(trade.members),
                "words": trade.words(),
                **_finding(trade.finding, rejected=False),
            }
            for trade in ([] if rejected else diagnosis.trades)
        ],
        **({"jaw_force": dict(vars(diagnosis.grip))} if diagnosis.grip else {}),
        "notes": [dict(vars(note)) for note in ordered],
    }


def read_verdicts(path: Path) -> dict[str, Any]:
    """Read a file of verdicts."""
    return read_object(path, "verdicts", {"quantities", "trades", "notes"}, "holds no verdicts")


def _finding(finding: "Finding", *, rejected: bool) -> dict[str, Any]:
    profile = finding.profile
    return {
        "quantity": finding.quantity.label,
        "symbol": finding.quantity.symbol,
        "unit": finding.quantity.unit,
        "verdict": FIT_REJECTED if rejected else finding.verdict,
        "value": finding.value,
        "low": None if rejected else finding.low,
        "high": None if rejected else finding.high,
        "excluded": [] if rejected else [[start, end] for start, end in finding.gaps],
        "deviation": finding.deviation,
        "provided": finding.quantity.provided,
        "in_words": f"fit rejected: the best fit, {finding.best_in_words}, is not to be used"
        if rejected
        else finding.words(),
        "profile": {
            "values": [float(value) for value in np.exp(profile.log_values)],
            "increases": [round_increase(float(increase)) for increase in profile.increases],
        },
    }
