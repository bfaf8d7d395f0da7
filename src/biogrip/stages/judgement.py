"""Verdicts on the first trace of a case, and those to expect of any, from its trace without noise.

A trace is judged as `biogrip identify` judges it; of a simulated one the experiment is known, so
that neither start, offset, drift nor model are doubted.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from biogrip.digits import rounded_numbers
from biogrip.files import write_text
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_from
from biogrip.identify.data import judged_data
from biogrip.identify.identify import identify_alike
from biogrip.identify.prepare import for_trace
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.physics.noise import rms, standard_deviation
from biogrip.records.traces import Measurements, read_measurements, read_target
from biogrip.study.study import Case

TRACE = 0
"""Seed of the trace that is judged."""


def experiment_for(
    experiment: Experiment, measurements: Measurements, calibrated: Sequence[Path]
) -> Experiment:
    """Return the experiment that traces of a case are identified by: see `for_trace`."""
    experiment = experiment.calibrated(calibrated)
    if experiment.simulated:
        return experiment.weighted(measurements.sd)
    return for_trace(experiment, measurements.recording)


def judge(case: Case, measurements: Path, calibrated: list[Path], verdicts: Path) -> None:
    """Identify the trace of seed 0, and write verdicts, profiles and valley."""
    recorded = read_measurements(measurements, [TRACE])
    experiment = experiment_for(case.judged_experiment, recorded, calibrated)
    (diagnosis,) = identify_alike([(recorded.recording, experiment)], valley=True)
    assert diagnosis.fit
    more = {"noise_model": diagnosis.fit.noise_data(), "valley": diagnosis.valley}
    _write(verdicts, case, diagnosis, more)


def expect(case: Case, target: Path, calibrated: list[Path], verdicts: Path) -> None:
    """Write verdicts on the trace without noise, judged with the noise level of the measurement.

    They are what to expect of any trace of the case. Without noise, the rounding of the
    target's digits takes its place.
    """
    experiment = case.experiment.to_identify().calibrated(calibrated)
    time_s, _, rotation = read_target(target)
    noise_sd = rms(standard_deviation(rotation, case.noise)) or None
    problem = experiment.of(time_s, rotation, noise_sd=noise_sd)
    found = identify_from(problem, experiment.logs(case.parameters))
    diagnosis = diagnose(
        problem, experiment.searched, found, confidence=case.confidence, noise_sd=noise_sd
    )
    _write(verdicts, case, diagnosis, {})


def _write(path: Path, case: Case, diagnosis: Diagnosis, more: dict[str, Any]) -> None:
    """Write a diagnosis as JSON. The case says what is read, and no name has its unit."""
    said = {
        key.removesuffix("_rad"): value
        for key, value in rounded_numbers(judged_data(diagnosis)).items()
    }
    head = {"case": case.name, "model": case.sample.model.name, "confidence": case.confidence}
    write_text(path, json.dumps(head | said | more, indent=1) + "\n")
