"""Stage 4: what one trace of a case tells about its sample, and what it does not."""

import json
from pathlib import Path
from typing import Any

from biogrip.files import write_text
from biogrip.identifiability.diagnosis import diagnose
from biogrip.identifiability.document import diagnosis_data
from biogrip.identifiability.valley import valley_data
from biogrip.identify.answer import silent
from biogrip.identify.methods import identifier
from biogrip.identify.multi_start import fitted_from
from biogrip.measurement import Noise, rms, standard_deviation
from biogrip.random_streams import stream
from biogrip.study.case_problem import case_problem
from biogrip.traces import read_measurements, read_target

TRACE = 0
"""The seed whose trace is judged."""


def run(
    settings: dict[str, Any], measurements: Path, output: Path, calibrated: Path | None = None
) -> None:
    """Judge the trace of the first seed, identified by least squares.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``confidence``, what `case_problem` needs, and
        ``least_squares``.
    measurements
        Noisy traces, Parquet.
    output
        Verdicts, profiles and valley, JSON.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    posed = case_problem(settings, calibrated)
    recorded = read_measurements(measurements, [TRACE])
    problem = posed.of(recorded.time_s, recorded.rotation_rad[TRACE])
    identify = identifier("least_squares", settings)
    rng = stream(settings["study_seed"], settings["case"], TRACE, "identifiability")
    found = identify(problem, rng, silent)
    confidence = settings["confidence"]
    told = diagnose(
        problem, posed.searched, found, confidence=confidence, noise_rad=posed.noise_rad
    )
    data = {
        "case": settings["case"],
        "model": posed.model.name,
        "confidence": confidence,
        **diagnosis_data(told),
        "valley": valley_data(told.likelihood, posed.searched),
    }
    write_text(output, json.dumps(data, indent=1) + "\n")


def expected(
    settings: dict[str, Any], target: Path, output: Path, calibrated: Path | None = None
) -> None:
    """Judge the trace without noise as if it had the noise of the measurement.

    What such a trace determines, any trace of the case does but for its luck.

    Parameters
    ----------
    settings
        As of `run`, and ``parameters``, the true ones, and ``noise``.
    target
        A target, CSV.
    output
        Verdicts and profiles, JSON.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    posed = case_problem(settings, calibrated)
    time_s, _, rotation = read_target(target)
    noise_rad = rms(standard_deviation(rotation, Noise(**settings["noise"])))
    problem = posed.of(time_s, rotation, noise_rad=noise_rad)
    found = fitted_from(problem, posed.logs(settings["parameters"]))
    confidence = settings["confidence"]
    told = diagnose(problem, posed.searched, found, confidence=confidence, noise_rad=noise_rad)
    data = {
        "case": settings["case"],
        "model": posed.model.name,
        "confidence": confidence,
        **diagnosis_data(told),
    }
    write_text(output, json.dumps(data, indent=1) + "\n")
