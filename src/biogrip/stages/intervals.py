"""Full verdicts, as users are shown them, for some seeds of the coverage test.

Stage 4: estimates and intervals of many seeds, to test coverage and spread.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.methods import best_fit, identifier
from biogrip.fit.multi_start import fit_from
from biogrip.fit.problem import Identification, Problem, silent
from biogrip.fit.trace_fit import trace_fit
from biogrip.judging.fisher import covariance
from biogrip.judging.likelihood import MISSED, Likelihood, make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, Finding
from biogrip.physics.noise import add_noise, standard_deviation, stream
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.progress import Progress
from biogrip.records.identifications import INTERVALS
from biogrip.records.traces import read_target
from biogrip.records.verdicts import read_verdicts
from biogrip.stages.identification import groups
from biogrip.study.study import Case

_MOST_RESTARTS = 3


@dataclass(frozen=True)
class Shown:
    """Verdict on a quantity, and its limits."""

    verdict: str
    low: float | None
    high: float | None


def refitted(likelihood: Likelihood, missed: np.ndarray, confidence: float) -> Likelihood | None:
    """Fit again, started at parameters of a chi^2 below the optimum's; None if it did not fall."""
    fit = fit_from([likelihood.problem], missed)
    misfit_rad = float(fit.misfit_rad[0])
    if likelihood.increase(misfit_rad) > -MISSED:
        return None
    return make_likelihood(likelihood.problem, fit.x[0], misfit_rad, confidence=confidence)


def shown_of(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], confidence: float
) -> Iterator[list[Shown]]:
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
        findings = [Finding(q, profile, 0.0) for q, profile in zip(quantities, own, strict=True)]
        yield [Shown(found.verdict, found.low, found.high) for found in findings]


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
    """Fit a batch of seeds by least squares, and compute intervals of determined quantities.

    The noise of a seed is that of its measurement. A second estimate has parameters without
    information fixed at their true values, as the Cramér-Rao bound assumes. Some seeds get a full
    verdict as well, as users are shown it: multiples of `verdicts_every`, whatever the batch.
    """
    case_problem = case.problem.calibrated(calibrated)
    time_s, _, rotation = read_target(target)
    INTERVALS.write(
        intervals, _rows(case, case_problem, seeds, time_s, rotation, _determined(expected))
    )


@dataclass(frozen=True)
class _Quantities:
    """All quantities, and indices of those that traces should determine."""

    every: list[Quantity]
    selected: list[int]


def _rows(
    case: Case,
    case_problem: CaseProblem,
    seeds: Sequence[int],
    time_s: Array,
    rotation: Array,
    selected: set[str],
) -> Iterator[tuple[str | int, ...]]:
    every = parameters_and_sum(case_problem.searched)
    chosen = _Quantities(every, [i for i, q in enumerate(every) if q.label in selected])
    rest_known, informed, truth = _rest_known(case, case_problem, time_s, rotation)
    progress = Progress(f"{case.name}, intervals", len(seeds))
    # Combine groups until they hold enough seeds with full verdicts.
    for some in groups(seeds, case.verdicts_every):
        lines: dict[int, list[list[str]]] = {}
        in_full: dict[int, Likelihood] = {}
        for group in groups(some, _TIMES):
            traces = _traces(case, group, time_s, rotation)
            likelihoods, limits = _fitted(case, case_problem, group, time_s, traces, chosen)
            known = np.tile(truth, (len(group), 1))
            if len(informed):
                simpler = case_problem.of_each(time_s, traces, rest_known)
                known[:, informed] = fit_from(simpler, truth[informed]).x
            for index, seed in enumerate(group):
                best = likelihoods[index].best
                lines[seed] = _lines(chosen, best, limits[index], known[index])
                if seed % case.verdicts_every == 0:
                    in_full[seed] = likelihoods[index]
            progress.done(len(group))
        shown = shown_of(list(in_full.values()), chosen.every, case.confidence)
        verdicts = dict(zip(in_full, shown, strict=True))
        yield from _of_seeds(case.name, chosen, lines, verdicts)


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


def _traces(case: Case, group: Sequence[int], time_s: Array, rotation: Array) -> list[Array]:
    rngs = [stream(case.study.study_seed, case.name, seed, "noise") for seed in group]
    return [add_noise(rotation, case.noise, rng, time_s) for rng in rngs]


def _fitted(
    case: Case,
    case_problem: CaseProblem,
    group: Sequence[int],
    time_s: Array,
    traces: list[Array],
    chosen: _Quantities,
) -> tuple[list[Likelihood], Array]:
    """Return optima of a group and their limits; refit where a profile has a lower chi^2."""
    rngs = [stream(case.study.study_seed, case.name, seed, "coverage") for seed in group]
    confidence = case.confidence
    found = [
        make_likelihood(problem, np.log(each.parameters), each.misfit_rad, confidence=confidence)
        for problem, each in _optima(case, case_problem, time_s, traces, rngs)
    ]
    quantities = [chosen.every[index] for index in chosen.selected]
    limits, missed = find_limits(found, quantities)
    for trace, x in missed.items():
        if (again := refitted(found[trace], x, confidence)) is not None:
            found[trace], limits[trace] = again, find_limits([again], quantities)[0][0]
    return found, limits


def _optima(
    case: Case,
    case_problem: CaseProblem,
    time_s: Array,
    traces: list[Array],
    rngs: Sequence[np.random.Generator],
) -> Iterator[tuple[Problem, Identification]]:
    """Yield problems and fits of traces, fitted together if their noise is white."""
    if case_problem.plain:
        problems = case_problem.of_each(time_s, traces)
        identify = identifier("least_squares", case.least_squares)
        yield from zip(problems, identify(problems, rngs, silent), strict=True)
        return
    for trace, rng in zip(traces, rngs, strict=True):

        def find(problem: Problem, rng: np.random.Generator = rng) -> Identification:
            return best_fit(problem, case.least_squares, rng, silent)

        fit = trace_fit(case_problem, time_s, trace, find)
        yield fit.problem, fit.found


def _lines(chosen: _Quantities, best: Array, limits: Array, known: Array) -> list[list[str]]:
    """Return estimate, limits and estimate with the rest fixed for every quantity, as text."""
    lines = [[_text(quantity.log(best), _DIGITS), "", "", ""] for quantity in chosen.every]
    for which, index in enumerate(chosen.selected):
        quantity, (low, high) = chosen.every[index], limits[which]
        digits = _MORE_DIGITS if high - low < _NARROW else _DIGITS
        found = quantity.log(best), low, high, quantity.log(known)
        lines[index] = [_text(logarithm, digits) for logarithm in found]
    return lines


def _of_seeds(
    case: str,
    chosen: _Quantities,
    lines: Mapping[int, list[list[str]]],
    verdicts: Mapping[int, Sequence[Shown]],
) -> Iterator[tuple[str | int, ...]]:
    for seed, of_seed in lines.items():
        for index, (quantity, line) in enumerate(zip(chosen.every, of_seed, strict=True)):
            shown = verdicts[seed][index] if seed in verdicts else None
            if shown or index in chosen.selected:
                limits = (shown.low, shown.high) if shown else (None, None)
                texts = ["" if limit is None else f"{limit:.5g}" for limit in limits]
                yield case, quantity.label, seed, *line, shown.verdict if shown else "", *texts


def _text(logarithm: float, digits: int) -> str:
    return "" if math.isnan(logarithm) else f"{math.exp(logarithm):.{digits}g}"


def _determined(expected: Path) -> set[str]:
    found = read_verdicts(expected)["quantities"]
    return {item["quantity"] for item in found if item["verdict"] == DETERMINED}
