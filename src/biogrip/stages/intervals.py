"""Estimates and intervals of many seeds, to test the coverage of limits and the spread of fits.

Every seed is fitted by least squares, and quantities that traces should determine get limits from
their profile likelihoods. A second estimate has parameters without information fixed at their true
values, as the Cramér-Rao bound assumes. Some seeds get a full verdict as well, as users are shown
it: multiples of `verdicts_every`, whatever the batch.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import fit_from
from biogrip.fit.trace_fit import TraceFit, fit_least_squares
from biogrip.judging.diagnosis import Diagnosis, profiled, settled
from biogrip.judging.likelihood import Likelihood, covariance
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, Finding, compute_findings
from biogrip.physics.noise import add_noise, standard_deviation
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.records.identifications import INTERVALS, read_verdicts
from biogrip.records.traces import read_target
from biogrip.stages.identification import groups
from biogrip.study.study import Case
from biogrip.terminal import Progress

# Significant digits, and those of values known to within a relative `_NARROW`.
_DIGITS, _MORE_DIGITS, _NARROW = 5, 9, 1e-3
# Local fits need less memory per seed than populations.
_TIMES = 2


def estimate(
    case: Case,
    seeds: Sequence[int],
    target: Path,
    expected: Path,
    calibrated: list[Path],
    intervals: Path,
) -> None:
    """Fit a batch of seeds, and compute intervals of what `expected` verdicts call determined.

    The noise of a seed is that of its measurement.
    """
    experiment = case.judged_experiment.calibrated(calibrated)
    time_s, _, rotation = read_target(target, case.times_s)
    found = read_verdicts(expected)["quantities"]
    determined = {item["quantity"] for item in found if item["verdict"] == DETERMINED}
    every = parameters_and_sum(experiment.searched)
    selected = [index for index, quantity in enumerate(every) if quantity.label in determined]
    rest_known, informed, truth = _rest_known(case, experiment, time_s, rotation)
    progress = Progress(f"{case.name}, intervals", len(seeds))
    rows: list[tuple[Any, ...]] = []
    for group in groups(seeds, _TIMES):
        rngs = [experiment.stream("noise", seed) for seed in group]
        traces = [add_noise(rotation, case.noise, rng, time_s) for rng in rngs]
        fits = fit_least_squares(
            [experiment] * len(traces),
            [(time_s, trace) for trace in traces],
            [experiment.stream("coverage", seed) for seed in group],
        )
        known = np.tile(truth, (len(group), 1))
        if len(informed):
            simpler = experiment.of_each(time_s, traces, rest_known)
            known[:, informed] = fit_from(simpler, truth[informed]).x
        for in_full, shown in ((True, [*range(len(every))]), (False, selected)):
            often = case.block.identifiability.verdicts_every
            some = [i for i, seed in enumerate(group) if (seed % often == 0) == in_full]
            if not (some and shown):
                continue
            quantities = [every[which] for which in shown]
            judged = judge_quantities([fits[i] for i in some], quantities, case.confidence)
            for i, diagnosis in zip(some, judged, strict=True):
                for which, finding in zip(shown, diagnosis.findings, strict=True):
                    given = (finding, known[i]) if which in selected else None
                    texts = _estimates(every[which], diagnosis.likelihood.best, given)
                    ends = finding.low, finding.high
                    limits = ("" if end is None else f"{end:.5g}" for end in ends)
                    verdict = (finding.verdict, *limits) if in_full else ("", "", "")
                    rows.append((case.name, every[which].label, group[i], *texts, *verdict))
        progress.done(len(group))
    INTERVALS.write(intervals, sorted(rows, key=lambda row: row[2]))


def _rest_known(
    case: Case, experiment: Experiment, time_s: Array, rotation: Array
) -> tuple[SampleModel, IntArray, Array]:
    """Return the model with uninformed parameters fixed, indices of the others, and the truth."""
    truth = experiment.logs(case.parameters)
    _, sensitivity = experiment.of(time_s, rotation).residuals(truth)
    spread = np.diag(covariance(sensitivity, standard_deviation(rotation, case.noise)))
    informed = np.flatnonzero(np.isfinite(spread))
    names = experiment.searched.names
    given = {name: case.parameters[name] for i, name in enumerate(names) if i not in informed}
    return with_fixed(experiment.searched, given), informed, truth


def judge_quantities(
    fits: Sequence[TraceFit], quantities: Sequence[Quantity], confidence: float
) -> list[Diagnosis]:
    """Judge quantities of traces as users are shown them, but for notes and combinations."""

    def profile(likelihoods: Sequence[Likelihood]) -> list[Diagnosis]:
        every = compute_findings(likelihoods, quantities, smooth=False)
        return [profiled(*pair, []) for pair in zip(likelihoods, every, strict=True)]

    problems, found = [fit.problem for fit in fits], [fit.found for fit in fits]
    return settled(problems, found, profile, confidence=confidence, noise_sd=[None] * len(fits))


def _estimates(
    quantity: Quantity, best: Array, with_limits: tuple[Finding, Array] | None
) -> list[str]:
    """Return estimate, limits and estimate with the rest fixed, as text; the last three if given.

    Given are limits and the log-parameters of the fit with the rest fixed.
    """
    logs, digits = [quantity.log(best), None, None, None], _DIGITS
    if with_limits is not None:
        finding, known = with_limits
        low, high = finding.profile.low, finding.profile.high
        logs[1:] = low, high, quantity.log(known)
        narrow = low is not None and high is not None and high - low < _NARROW
        digits = _MORE_DIGITS if narrow else _DIGITS
    return ["" if log is None else f"{math.exp(log):.{digits}g}" for log in logs]
