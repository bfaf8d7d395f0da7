"""Diagnoses as plain data and JSON files."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.digits import round_increase, rounded_numbers
from biogrip.products.files.json_object import read_object

if TYPE_CHECKING:
    from biogrip.identifiability.diagnosis import Diagnosis
    from biogrip.identifiability.verdicts import Finding

PATH = "results/identifiability/{case}.json"
EXPECTED = "results/identifiability/expected/{case}.json"


def diagnosis_data(diagnosis: "Diagnosis") -> dict[str, Any]:
    """Return a diagnosis as plain data in SI units, rounded."""
    data: dict[str, Any] = rounded_numbers(exact_data(diagnosis))
    return data


def exact_data(diagnosis: "Diagnosis") -> dict[str, Any]:
    """Return a diagnosis like `diagnosis_data`, with only chi^2 increases rounded."""
    likelihood = diagnosis.likelihood
    return {
        "samples": likelihood.problem.residuals.samples,
        "misfit_rad": likelihood.misfit_rad,
        "noise_rad": likelihood.noise_rad,
        "threshold": likelihood.threshold,
        "certainty": likelihood.certainty,
        "quantities": [_finding(finding) for finding in diagnosis.findings],
        "trades": [
            {
                "members": list(trade.members),
                "words": trade.words(),
                **_finding(trade.finding),
            }
            for trade in diagnosis.trades
        ],
        "jaw_force": dict(vars(diagnosis.grip)),
        "notes": diagnosis.notes,
    }


def read_verdicts(path: Path) -> dict[str, Any]:
    """Read a file of verdicts.

    Raises
    ------
    BiogripError
        If the file is missing or invalid.
    """
    return read_object(path, "verdicts", {"quantities", "trades", "notes"}, "holds no verdicts")


def bounded_on_a_side(verdicts: dict[str, Any]) -> set[str]:
    """Return the quantities whose verdict is not just an upper bound."""
    return {q["quantity"] for q in verdicts["quantities"] if q["verdict"] != "bounded above"}


def _finding(finding: "Finding") -> dict[str, Any]:
    profile = finding.profile
    return {
        "quantity": finding.quantity.label,
        "symbol": finding.quantity.symbol,
        "unit": finding.quantity.unit,
        "verdict": finding.verdict,
        "value": finding.value,
        "low": finding.low,
        "high": finding.high,
        "excluded": [[start, end] for start, end in finding.gaps],
        "deviation": finding.deviation,
        "provided": finding.quantity.provided,
        "in_words": finding.words(),
        "profile": {
            "values": [float(value) for value in np.exp(profile.log_values)],
            "increases": [round_increase(float(increase)) for increase in profile.increases],
        },
    }
