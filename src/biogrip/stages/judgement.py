"""Verdicts on one trace of a case, and those to expect of any, from its trace without noise.

The trace is fitted by least squares, with the noise model of the case. Profile likelihoods of the
fit give limits and verdicts of every quantity.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.files import write_text
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_from
from biogrip.fit.methods import identifier
from biogrip.fit.nested_fits import deepen
from biogrip.fit.problem import Fit, Progress, TraceProblem, silent
from biogrip.fit.trace_fit import TraceFit, fit_traces
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.doubts import HARMLESS, Note, find_slow_misfit
from biogrip.judging.onset import notes_on_start, profile_over_onset
from biogrip.physics.noise import rms, standard_deviation, stream
from biogrip.records.identifications import diagnosis_data
from biogrip.records.traces import read_measurements, read_target
from biogrip.study.study import Case

TRACE = 0
"""Seed of the trace that is judged."""


def fits_judged(
    cases: Sequence[Case],
    experiments: Sequence[Experiment],
    traces: Sequence[tuple[Array, Array]],
    seed: int,
    progress: Progress = silent,
) -> list[TraceFit]:
    """Return the least-squares fits of traces that their judgements are based on.

    Traces are pairs of times and readings, (n_samples,) each, one of each case; the cases have
    the same budget of least squares.
    """
    least_squares = identifier("least_squares", cases[0].block.least_squares)

    def find(problems: Sequence[TraceProblem], which: Sequence[int]) -> list[Fit]:
        names = [(cases[index].study.study_seed, cases[index].name) for index in which]
        rngs = [stream(study_seed, name, seed, "identifiability") for study_seed, name in names]
        return deepen(problems, least_squares(problems, rngs, progress))

    return fit_traces(experiments, traces, find)


def judge(case: Case, measurements: Path, calibrated: list[Path], verdicts: Path) -> None:
    """Fit the trace of seed 0 by least squares, and write verdicts, profiles and valley."""
    recorded = read_measurements(measurements, [TRACE])
    experiment = case.problem.calibrated(calibrated).weighted(recorded.sd)
    trace = recorded.readings[TRACE]
    (fit,) = fits_judged([case], [experiment], [(recorded.time_s, trace)], TRACE)
    diagnosis = diagnose(
        fit.problem,
        experiment.searched,
        fit.found,
        confidence=case.confidence,
        noise_sd=experiment.noise_sd,
        valley=True,
    )
    if experiment.fit_start:
        diagnosis, _ = profile_over_onset(diagnosis, recorded.time_s)
    notes = notes_on_fit(fit)
    if case.may_start_late:
        notes += notes_on_start(experiment, recorded.time_s, trace, diagnosis, may_be_late=True)
    said = diagnosis_data(diagnosis, notes)
    _write(verdicts, case, {**said, "noise_model": fit.noise_data(), "valley": diagnosis.valley})


def notes_on_fit(fit: TraceFit) -> list[Note]:
    """Return notes on the noise model of a fit; one that may hold misfit makes it doubtful."""
    notes = [Note(HARMLESS, text) for text in fit.notes()]
    if fit.noise_model is None:
        return notes
    residuals = fit.problem.residuals
    peak = np.max(np.abs(residuals.response(np.log(fit.found.parameters))))
    slow = fit.noise_model.ar1 + fit.noise_model.walk
    share = float(fit.found.misfit * np.sqrt(slow) / peak)
    given = fit.noise_model, fit.time_error, residuals.duration_s, share
    misfit = find_slow_misfit(*given, residuals.instrument)
    return [misfit, *notes] if misfit else notes


def expect(case: Case, target: Path, calibrated: list[Path], verdicts: Path) -> None:
    """Write verdicts on the trace without noise, judged with the noise level of the measurement.

    They are what to expect of any trace of the case. Without noise, the rounding of the
    target's digits takes its place.
    """
    experiment = case.problem.to_identify().calibrated(calibrated)
    time_s, _, rotation = read_target(target)
    noise_sd = rms(standard_deviation(rotation, case.noise)) or None
    problem = experiment.of(time_s, rotation, noise_sd=noise_sd)
    found = identify_from(problem, experiment.logs(case.parameters))
    diagnosis = diagnose(
        problem, experiment.searched, found, confidence=case.confidence, noise_sd=noise_sd
    )
    _write(verdicts, case, diagnosis_data(diagnosis))


def _write(verdicts: Path, case: Case, said: dict[str, Any]) -> None:
    head = {"case": case.name, "model": case.problem.model.name, "confidence": case.confidence}
    write_text(verdicts, json.dumps(head | said, indent=1) + "\n")
