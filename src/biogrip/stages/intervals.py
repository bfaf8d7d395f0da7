"""Estimates and intervals of many seeds, to test the coverage of limits and the spread of fits.

Every seed is fitted by least squares, and quantities that traces should determine get limits from
their profile likelihoods. A second estimate has parameters without information fixed at their true
values, as the Cramér-Rao bound assumes. Some seeds get a full verdict as well, as users are shown
it: multiples of `verdicts_every`, whatever the batch.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.least_squares import fit_from
from biogrip.fit.methods import identifier
from biogrip.fit.problem import CaseProblem, Identification, Problem, silent
from biogrip.fit.trace_fit import fit_traces
from biogrip.judging.likelihood import MISSED, Likelihood, covariance, make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, Finding
from biogrip.physics.noise import add_noise, standard_deviation, stream
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.records.identifications import INTERVALS, read_verdicts
from biogrip.records.traces import read_target
from biogrip.stages.identification import groups
from biogrip.study.study import Case
from biogrip.terminal import Progress

_MOST_RESTARTS = 3
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
    case_problem = case.problem.calibrated(calibrated)
    time_s, _, rotation = read_target(target)
    found = read_verdicts(expected)["quantities"]
    determined = {item["quantity"] for item in found if item["verdict"] == DETERMINED}
    INTERVALS.write(intervals, _rows(case, case_problem, seeds, time_s, rotation, determined))


def _rows(
    case: Case,
    case_problem: CaseProblem,
    seeds: Sequence[int],
    time_s: Array,
    rotation: Array,
    determined: set[str],
) -> Iterator[tuple[str | int, ...]]:
    every = parameters_and_sum(case_problem.searched)
    selected = [index for index, quantity in enumerate(every) if quantity.label in determined]
    rest_known, informed, truth = _rest_known(case, case_problem, time_s, rotation)
    progress = Progress(f"{case.name}, intervals", len(seeds))
    # Combine groups until they hold enough seeds with full verdicts.
    for some in groups(seeds, case.block.identifiability.verdicts_every):
        estimates: dict[int, list[list[str]]] = {}
        in_full: dict[int, Likelihood] = {}
        for group in groups(some, _TIMES):
            rngs = [stream(case.study.study_seed, case.name, seed, "noise") for seed in group]
            traces = [add_noise(rotation, case.noise, rng, time_s) for rng in rngs]
            quantities = [every[index] for index in selected]
            found = _optima(case, case_problem, group, time_s, traces)
            likelihoods, limits = _limited(case, found, quantities)
            known = np.tile(truth, (len(group), 1))
            if len(informed):
                simpler = [case_problem.of(time_s, trace, rest_known) for trace in traces]
                known[:, informed] = fit_from(simpler, truth[informed]).x
            for index, seed in enumerate(group):
                with_limits = dict(zip(selected, limits[index], strict=True))
                best = likelihoods[index].best
                estimates[seed] = _estimates(every, best, with_limits, known[index])
                if seed % case.block.identifiability.verdicts_every == 0:
                    in_full[seed] = likelihoods[index]
            progress.done(len(group))
        shown = shown_of(list(in_full.values()), every, case.confidence)
        findings = dict(zip(in_full, shown, strict=True))
        for seed, of_seed in estimates.items():
            for index, (quantity, texts) in enumerate(zip(every, of_seed, strict=True)):
                verdict = _verdict(findings[seed][index]) if seed in findings else ["", "", ""]
                if seed in findings or index in selected:
                    yield case.name, quantity.label, seed, *texts, *verdict


def _rest_known(
    case: Case, case_problem: CaseProblem, time_s: Array, rotation: Array
) -> tuple[SampleModel, IntArray, Array]:
    """Return the model with uninformed parameters fixed, indices of the others, and the truth."""
    truth = case_problem.logs(case.parameters)
    _, sensitivity = case_problem.of(time_s, rotation).residuals(truth)
    spread = np.diag(covariance(sensitivity, standard_deviation(rotation, case.noise)))
    informed = np.flatnonzero(np.isfinite(spread))
    names = case_problem.searched.names
    given = {name: case.parameters[name] for i, name in enumerate(names) if i not in informed}
    return with_fixed(case_problem.searched, given), informed, truth


def _limited(
    case: Case, optima: Iterable[tuple[Problem, Identification]], quantities: Sequence[Quantity]
) -> tuple[list[Likelihood], Array]:
    """Return likelihoods of optima and their limits; refit where a profile has a lower chi^2."""
    confidence = case.confidence
    found = [
        make_likelihood(problem, np.log(each.parameters), each.misfit, confidence=confidence)
        for problem, each in optima
    ]
    limits, missed = find_limits(found, quantities)
    for trace, x in missed.items():
        if (again := refitted(found[trace], x, confidence)) is not None:
            found[trace], limits[trace] = again, find_limits([again], quantities)[0][0]
    return found, limits


def _optima(
    case: Case,
    case_problem: CaseProblem,
    group: Sequence[int],
    time_s: Array,
    traces: list[Array],
) -> list[tuple[Problem, Identification]]:
    """Return problems and fits of traces, fitted together if their noise is white."""
    rngs = [stream(case.study.study_seed, case.name, seed, "coverage") for seed in group]
    identify = identifier("least_squares", case.block.least_squares)

    def find(problems: Sequence[Problem], which: Sequence[int]) -> list[Identification]:
        return identify(problems, [rngs[index] for index in which], silent)

    posed = [case_problem] * len(traces)
    fits = fit_traces(posed, [(time_s, trace) for trace in traces], find)
    return [(fit.problem, fit.found) for fit in fits]


def refitted(likelihood: Likelihood, missed: Array, confidence: float) -> Likelihood | None:
    """Fit again, started at parameters of a chi^2 below the optimum's; None if it did not fall."""
    fit = fit_from([likelihood.problem], missed)
    misfit = float(fit.misfit[0])
    if likelihood.increase(misfit) > -MISSED:
        return None
    return make_likelihood(likelihood.problem, fit.x[0], misfit, confidence=confidence)


def shown_of(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], confidence: float
) -> Iterator[list[Finding]]:
    """Yield verdicts on each trace, as `diagnose` gives them, for all quantities."""
    current = list(likelihoods)
    profiles = compute_profiles(current, quantities, smooth=False)
    for _ in range(_MOST_RESTARTS):
        lowest = [min(own, key=lambda each: float(each.increases.min())) for own in profiles]
        again = {
            index: new
            for index, each in enumerate(lowest)
            if each.increases.min() < -MISSED
            and (new := refitted(current[index], each.lowest, confidence)) is not None
        }
        if not again:
            break
        renewed = compute_profiles(list(again.values()), quantities, smooth=False)
        for (index, likelihood), own in zip(again.items(), renewed, strict=True):
            current[index], profiles[index] = likelihood, own
    for own in profiles:
        yield [Finding(q, profile, 0.0) for q, profile in zip(quantities, own, strict=True)]


def _estimates(
    every: Sequence[Quantity], best: Array, with_limits: Mapping[int, Array], known: Array
) -> list[list[str]]:
    """Return estimate, limits and estimate with the rest fixed for every quantity, as text."""
    texts = []
    for index, quantity in enumerate(every):
        logs, digits = [quantity.log(best), math.nan, math.nan, math.nan], _DIGITS
        if index in with_limits:
            low, high = with_limits[index]
            logs[1:] = low, high, quantity.log(known)
            digits = _MORE_DIGITS if high - low < _NARROW else _DIGITS
        texts.append(["" if math.isnan(log) else f"{math.exp(log):.{digits}g}" for log in logs])
    return texts


def _verdict(found: Finding) -> list[str]:
    limits = ["" if limit is None else f"{limit:.5g}" for limit in (found.low, found.high)]
    return [found.verdict, *limits]
