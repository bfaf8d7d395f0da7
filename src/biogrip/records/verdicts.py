"""Diagnoses as plain data and JSON files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.digits import round_increase, rounded_numbers
from biogrip.judging.doubts import (
    REJECTED,
    REJECTION,
    Note,
    compute_status,
    find_reasons,
    order_notes,
)
from biogrip.records.rows import read_object

if TYPE_CHECKING:
    from biogrip.judging.diagnosis import Diagnosis
    from biogrip.judging.verdicts import Finding

FIT_REJECTED = "fit rejected"
"""Verdict on every quantity of a fit that is rejected."""


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
        "misfit_rad": likelihood.misfit_rad,
        "noise_rad": None if rejected else likelihood.noise_rad,
        "scatter_rad": likelihood.problem.residuals.noise_scale_rad,
        "threshold": likelihood.threshold,
        "certainty": likelihood.certainty,
        "quantities": [_finding(each, rejected=rejected) for each in diagnosis.findings],
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


def bounded_on_a_side(verdicts: dict[str, Any]) -> set[str]:
    """Return the quantities whose verdict is not just an upper bound."""
    return {q["quantity"] for q in verdicts["quantities"] if q["verdict"] != "bounded above"}


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
        "in_words": _rejected_in_words(finding) if rejected else finding.words(),
        "profile": {
            "values": [float(value) for value in np.exp(profile.log_values)],
            "increases": [round_increase(float(increase)) for increase in profile.increases],
        },
    }


def _rejected_in_words(finding: "Finding") -> str:
    return f"fit rejected: the best fit, {finding.best_in_words}, is not to be used"
