"""Judgement of a case: verdicts on its first trace, those to expect, and intervals of many seeds.

`judge` writes verdicts on the first trace of a case, as `biogrip identify` judges it; of a
simulated one the experiment is known, so that neither start, offset, drift nor model are doubted.
`expect` writes those to expect of any, from the trace without noise.

`estimate_intervals` tests the coverage of limits and the spread of fits. Every seed is fitted by
least squares, and quantities that traces should determine get limits from their profile
likelihoods. Some seeds get a full verdict as well, as users are shown it: multiples of
`verdicts_every`, whatever the batch.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded_numbers
from biogrip.files import write_object
from biogrip.fit.least_squares import identify_from
from biogrip.fit.trace_fit import TraceFit, fit_least_squares
from biogrip.identify.data import judged_data
from biogrip.identify.identify import identify_alike
from biogrip.judging.diagnosis import Diagnosis, diagnose, settled
from biogrip.judging.likelihood import Likelihood, Quantity, parameters_and_sum
from biogrip.judging.profiles import DETERMINED, Finding, compute_findings
from biogrip.physics.noise import add_noise, rms, standard_deviation
from biogrip.terminal import Progress
from biogrip_study.config.study import Case
from biogrip_study.records.identifications import INTERVALS, read_verdicts
from biogrip_study.records.traces import read_measurements, read_target
from biogrip_study.stages.identification import experiment_for, seed_groups

JUDGED_SEED = 0
"""Seed of the trace that is judged."""


def judge(case: Case, measurements: Path, verdicts: Path) -> None:
    """Identify the trace of seed 0, and write verdicts and profiles.

    Parameters
    ----------
    case, measurements
        The case, and its traces, npz.
    verdicts
        Written, JSON.
    """
    recorded = read_measurements(measurements, [JUDGED_SEED])
    experiment = experiment_for(case.judged_experiment, recorded)
    (diagnosis,) = identify_alike([(recorded.recording, experiment)])
    assert diagnosis.fit
    _write_diagnosis(verdicts, case, diagnosis, {"noise_model": diagnosis.fit.noise_data()})


def expect(case: Case, target: Path, expected: Path) -> None:
    """Write verdicts on the trace without noise, judged with the noise level of the measurement.

    They are what to expect of any trace of the case. Without noise, the rounding of the
    target's digits takes its place.
    """
    experiment = case.experiment.to_identify()
    time_s, _, rotation = read_target(target, case.times_s)
    noise_sd = rms(standard_deviation(rotation, case.noise)) or None
    problem = experiment.of(time_s, rotation, noise_sd=noise_sd)
    truth = experiment.logs(case.parameters)
    best_fit = identify_from(problem, truth)
    misfit = float(problem.residuals.misfit(np.exp(truth)[None])[0])
    gain = len(time_s) * (misfit**2 - best_fit.misfit**2) / (noise_sd or best_fit.misfit) ** 2
    if gain < _GAIN_BY_ROUNDING:
        # Along what nothing tells, digits of the target would choose, and those of a processor.
        best_fit = replace(best_fit, parameters=np.exp(truth), misfit=misfit, converged=True)
    diagnosis = diagnose(problem, best_fit, confidence=case.confidence)
    _write_diagnosis(expected, case, diagnosis, {})


def _write_diagnosis(path: Path, case: Case, diagnosis: Diagnosis, more: dict[str, Any]) -> None:
    """Write a diagnosis as JSON. The case says what is read, and no name has its unit."""
    said = {
        key.removesuffix("_rad"): value
        for key, value in rounded_numbers(judged_data(diagnosis)).items()
    }
    head = {"case": case.name, "model": case.sample.model.name, "confidence": case.confidence}
    write_object(path, head | said | more)


# Decrease of chi^2 from the true parameters that is rounding.
_GAIN_BY_ROUNDING = 1e-3
# Significant digits, and those of values known to within a relative `_NARROW`.
_ESTIMATE_DIGITS, _MORE_DIGITS, _NARROW = 5, 9, 1e-3


def estimate_intervals(
    case: Case, seeds: Sequence[int], target: Path, expected: Path, intervals: Path
) -> None:
    """Fit a batch of seeds, and compute intervals of what `expected` verdicts call determined.

    The noise of a seed is that of its measurement.

    Parameters
    ----------
    case, seeds
        The case, and the seeds of the batch.
    target, expected
        Its trace without noise, CSV, and the verdicts to expect, JSON.
    intervals
        Written: a row per quantity and seed, CSV, see `INTERVALS`.
    """
    experiment = case.judged_experiment
    time_s, _, rotation = read_target(target, case.times_s)
    foreseen = read_verdicts(expected)["quantities"]
    determined = {item["quantity"] for item in foreseen if item["verdict"] == DETERMINED}
    every = parameters_and_sum(experiment.searched)
    selected = [quantity for quantity in every if quantity.label in determined]
    often = case.block.identifiability.verdicts_every
    progress = Progress(f"{case.name}, intervals", len(seeds))
    rows: list[tuple[Any, ...]] = []
    for group in seed_groups(seeds):
        rngs = [experiment.stream("noise", seed) for seed in group]
        traces = [add_noise(rotation, case.noise, rng, time_s) for rng in rngs]
        fits = fit_least_squares(
            [experiment] * len(traces),
            [(time_s, trace) for trace in traces],
            [experiment.stream("coverage", seed) for seed in group],
        )
        told = {(seed, quantity): [""] * 6 for seed in group for quantity in every}
        for in_full, shown in ((True, every), (False, selected)):
            some = [i for i, seed in enumerate(group) if (seed % often == 0) == in_full]
            if not (some and shown):
                continue
            judged = judge_quantities([fits[i] for i in some], shown, case.confidence)
            for i, diagnosis in zip(some, judged, strict=True):
                for quantity, finding in zip(shown, diagnosis.findings, strict=True):
                    texts = told[group[i], quantity]
                    if quantity in selected:
                        texts[:3] = _estimates(quantity, diagnosis.likelihood.best, finding)
                    if in_full:
                        ends = finding.low, finding.high
                        limits = ("" if end is None else f"{end:.5g}" for end in ends)
                        texts[3:] = finding.verdict, *limits
        rows += ((case.name, of.label, seed, *texts) for (seed, of), texts in told.items())
        progress.done(len(group))
    INTERVALS.write(intervals, rows)


def judge_quantities(
    fits: Sequence[TraceFit], quantities: Sequence[Quantity], confidence: float
) -> list[Diagnosis]:
    """Judge quantities of traces as users are shown them, but for notes and combinations.

    Parameters
    ----------
    fits
        Best fit of each trace.
    quantities
        Those of one model.
    confidence
        Of the limits, between 0 and 1.

    Returns
    -------
    list of Diagnosis
        That of each trace.
    """

    def profile(likelihoods: Sequence[Likelihood]) -> list[Diagnosis]:
        every = compute_findings(likelihoods, quantities)
        return list(map(Diagnosis, likelihoods, every))

    problems, best_fits = [fit.problem for fit in fits], [fit.found for fit in fits]
    judged = settled(problems, best_fits, profile, confidence=confidence)
    return [diagnosis for diagnosis, _ in judged]


def _estimates(quantity: Quantity, best: Array, finding: Finding) -> Iterator[str]:
    """Yield the estimate of a quantity at the best log-parameters, and its limits, as text."""
    low, high = finding.log_low, finding.log_high
    narrow = low is not None and high is not None and high - low < _NARROW
    digits = _MORE_DIGITS if narrow else _ESTIMATE_DIGITS
    for log in (quantity.log(best), low, high):
        yield "" if log is None else f"{math.exp(log):.{digits}g}"
