"""Fits of several sample models to the same traces: none fits worse than one that it contains.

Each model is fitted from starting points of its own and from the optima of the models that it
contains. Where one of these still fits better, because its optimum is out of reach of the
richer model's search range, it is the richer model's answer: with elements that have vanished
(`biogrip.experiment.nesting`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.experiment.nesting import as_richer, contained_in, different_in
from biogrip.experiment.sample import CANDIDATES
from biogrip.identify.answer import Identification, silent
from biogrip.identify.least_squares import LeastSquaresSettings, identify_many
from biogrip.identify.multi_start import fit_from
from biogrip.identify.problem import Problem

# What an element that has vanished is over the usual one, or under it, where a fit starts; and
# of an experiment, the time in which what is usual relaxes.
_AWAY, _SHARE = (3.0, 100.0), 0.1
# Relaxation times at which a further branch starts, over the usual one.
_FURTHER = 0.03, 1.0, 30.0
# Models that are the same in other parameters may lead one another on.
_MOST_ROUNDS = 3

Answers = list[Identification]


def fit_models(
    problems: Mapping[str, Sequence[Problem]],
    settings: LeastSquaresSettings,
    rngs: Mapping[str, Sequence[np.random.Generator]],
    done: Callable[[], None],
    near: Mapping[str, Array] | None = None,
) -> dict[str, Answers]:
    """Fit models to traces by least squares.

    Parameters
    ----------
    problems
        By candidate, the same traces posed for it.
    settings
        The budget of each fit.
    rngs
        By candidate, a source of randomness for each trace.
    done
        Is called after every model.
    near
        By candidate, log-parameters (n_traces, n_parameters) to start from as well.

    Returns
    -------
    dict of list of Identification
        By candidate, in the order given, the best fit to each trace. Parameters may be zero or
        infinite. Not converged is, too, what fits worse than a model within its own range.
    """
    found: dict[str, Answers] = {}
    for name in sorted(problems, key=lambda each: len(CANDIDATES[each].model.names)):
        further = []
        for trace, problem in enumerate(problems[name]):
            longest_s = problem.residuals.duration_s
            of_contained = _of_contained(name, found, trace, longest_s)
            points = [_within(start, problem) for start in of_contained]
            points += [near[name][trace]] if near and name in near else []
            further.append(np.reshape(points, (-1, len(problem.low))))
        found[name] = identify_many(problems[name], settings, rngs[name], silent, further)
        _add_branches(name, problems[name], found)
        done()
    _fit_again(problems, found)
    _take_simpler(problems, found)
    return {name: found[name] for name in problems}


def _of_contained(
    name: str, found: Mapping[str, Answers], trace: int, longest_s: float
) -> Iterator[Array]:
    """Starting points at the optima of models that one contains, in its own parameters.

    Elements that have vanished are there, where they begin to be felt and well before that.
    """
    kinds = np.array([parameter.kind for parameter in CANDIDATES[name].model.parameters])
    for inner in different_in(name, found):
        parameters = as_richer(name, inner, found[inner][trace].parameters)
        gone = (kinds != "exponent") & ((parameters == 0) | ~np.isfinite(parameters))
        for times in _AWAY if gone.any() else (1.0,):
            start = parameters.copy()
            for index in np.flatnonzero(gone):
                usual = _usual(kinds[index], kinds, parameters, ~gone, longest_s)
                start[index] = usual * times if parameters[index] else usual / times
            yield start


def _add_branches(name: str, problems: Sequence[Problem], found: dict[str, Answers]) -> None:
    """Take, in place, better fits that start with one branch more than a fit of fewer branches.

    Beside strong branches a weak one takes long to show: rough fits would not tell.
    """
    branches = CANDIDATES[name].model.free_branches
    fewer = [
        inner
        for inner in contained_in(name, found)
        if 0 < len(CANDIDATES[inner].model.free_branches) == len(branches) - 1
    ]
    for inner, (trace, problem) in product(fewer, enumerate(problems)):
        parameters = as_richer(name, inner, found[inner][trace].parameters)
        for start in _with_a_branch_more(parameters, np.array(branches)):
            again = found[name][trace].at(fit_from([problem], _within(start, problem)))
            if _digits(again) < _digits(found[name][trace]):
                found[name][trace] = again


def _with_a_branch_more(parameters: Array, branches: IntArray) -> Iterator[Array]:
    """Starting points with a branch in the place of one that is gone, weaker than the others."""
    sizes = parameters[branches]
    there = np.all((sizes > 0) & np.isfinite(sizes), axis=1)
    gone = np.flatnonzero(sizes[:, 0] == 0)
    if not (len(gone) and there.any()):
        return
    k, c = np.exp(np.mean(np.log(sizes[there]), axis=0)) / _AWAY[0]
    for times in _FURTHER:
        start = parameters.copy()
        start[branches[gone[-1]]] = k, times * c
        yield start


def _usual(kind: str, kinds: Array, values: Array, there: BoolArray, longest_s: float) -> float:
    """Size of the elements of a kind that are there; else, the others' within the experiment."""
    if np.any(own := there & (kinds == kind)):
        return float(np.exp(np.mean(np.log(values[own]))))
    others = values[there & (kinds != "exponent") & (values > 0)]
    relaxation_s = _SHARE * longest_s if kind == "damping" else 1 / (_SHARE * longest_s)
    return float(np.exp(np.mean(np.log(others)))) * relaxation_s


def _fit_again(problems: Mapping[str, Sequence[Problem]], found: dict[str, Answers]) -> None:
    """Fit again, in place, what fits worse than a model within its own range."""
    for _ in range(_MOST_ROUNDS):
        news = False
        for name, inner, trace in _worse(found):
            problem = problems[name][trace]
            parameters = as_richer(name, inner, found[inner][trace].parameters)
            if is_within(parameters, problem):
                again = found[name][trace].at(fit_from([problem], _within(parameters, problem)))
                if _digits(again) < _digits(found[name][trace]):
                    found[name][trace], news = again, True
        if not news:
            break


def _take_simpler(problems: Mapping[str, Sequence[Problem]], found: dict[str, Answers]) -> None:
    """Take, in place, a simpler model's optimum where a richer model does not reach it."""
    for name, inner, trace in _worse(found):
        simpler = found[inner][trace]
        parameters = as_richer(name, inner, simpler.parameters)
        reached = simpler.converged and not is_within(parameters, problems[name][trace])
        found[name][trace] = found[name][trace].replaced(
            parameters, simpler.misfit_rad, converged=reached
        )


def _worse(found: Mapping[str, Answers]) -> Iterator[tuple[str, str, int]]:
    """Find models, simpler ones first, models in them and traces to which these fit better."""
    for name in found:
        for inner in contained_in(name, found):
            pairs = zip(found[name], found[inner], strict=True)
            for trace, (answer, simpler) in enumerate(pairs):
                if _digits(simpler) < _digits(answer):
                    yield name, inner, trace


def _digits(answer: Identification) -> float:
    """Misfit to nine digits: what differs by less is the same on another processor."""
    return float(f"{answer.misfit_rad:.8e}")


def _within(parameters: Array, problem: Problem) -> Array:
    """Log-parameters within the search range."""
    with np.errstate(divide="ignore"):
        return np.clip(np.log(parameters), problem.low, problem.high)


def is_within(parameters: Array, problem: Problem) -> bool:
    """Whether parameters, (n_parameters,), lie in the search range."""
    with np.errstate(divide="ignore"):
        x = np.log(parameters)
    return bool(np.all((x >= problem.low) & (x <= problem.high)))
