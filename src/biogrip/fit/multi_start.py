"""Multi-start least squares: the best of several local fits, for many traces at once.

The result of a trace does not depend, to the last bit, on the other traces.

References
----------
.. [1] A. Raue et al., Lessons learned from quantitative dynamical modeling in systems biology,
   PLoS ONE 8 (2013), e74335: local fits from many starts.
"""

from bisect import insort
from collections.abc import Callable, Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.answer import History, Identification, Progress, Row, silent
from biogrip.fit.levenberg_marquardt import Minima
from biogrip.fit.local_fits import FAIR, FINE, ROUGH, LocalFits, alike
from biogrip.fit.newton_refinement import refine_optima
from biogrip.fit.problem import Problem

FINISHED = 4
"""Number of a trace's best rough fits that are continued to the optimum."""


def best_of_starts(
    problems: Sequence[Problem],
    starts: Sequence[Array],
    before: Sequence[Row],
    progress: Progress,
) -> list[Identification]:
    """Fit every trace from each of its starts and return the optima of lowest misfit.

    Misfits are compared in single precision and the first of equals wins, so that the
    last bits, which differ between processors, decide nothing.

    Parameters
    ----------
    problems
        One problem per trace.
    starts
        Log-parameters for each trace, (n_starts, n_parameters).
    before
        First row of the history of each trace: parameters, lowest and median misfit, and
        evaluations before the first fit.
    progress
        Called after every trace.
    """
    answers: dict[int, Identification] = {}
    for group in alike(problems):
        found = _best_of_alike(
            [problems[index] for index in group],
            [starts[index] for index in group],
            [before[index] for index in group],
            progress,
        )
        answers.update(zip(group.tolist(), found, strict=True))
    return [answers[index] for index in range(len(problems))]


def _best_of_alike(
    problems: Sequence[Problem],
    starts: Sequence[Array],
    before: Sequence[Row],
    progress: Progress,
) -> list[Identification]:
    fits, traces = LocalFits(problems), np.arange(len(problems))
    rough, trace, fine, trace_of_fine = _finished(fits, starts)
    winners = np.concatenate([_best(fine, trace_of_fine == own, 1) for own in traces])
    best = refine_optima(fits, fine[winners], traces)
    answers = []
    for own, first_row in enumerate(before):
        rows = _descents(rough[trace == own], first_row)
        # Newton's steps are not counted: the last bits of a processor decide their number.
        finished = fine.evaluations[trace_of_fine == own].sum()
        misfit_rad, evaluations = float(best.misfit_rad[own]), rows[-1][3] + int(finished)
        rows[-1] = np.exp(best.x[own]), misfit_rad, misfit_rad, evaluations
        progress(evaluations, misfit_rad)
        answers.append(_answer_of(rows, converged=bool(best.converged[own])))
    return answers


def _finished(
    fits: LocalFits, starts: Sequence[Array]
) -> tuple[Minima, IntArray, Minima, IntArray]:
    """Fit roughly from all starts, then finely from the best; return both with their traces."""
    trace = np.repeat(np.arange(len(starts)), [len(own_starts) for own_starts in starts])
    rough = fits.fitted(np.concatenate(starts), trace, ROUGH)
    # Rough fits show which basins are deepest; only the best are continued to the optimum.
    best = [_best(rough, trace == own, FINISHED) for own in range(len(starts))]
    finalists = np.concatenate(best)
    return rough, trace, fits.fitted(rough.x[finalists], trace[finalists]), trace[finalists]


def identify_from(problem: Problem, start: Array) -> Identification:
    """Fit a trace from a single start, (n_parameters,) log-parameters."""
    misfit = float(problem.misfit(np.exp(start)[None])[0])
    row = np.exp(start), misfit, misfit, 1
    return best_of_starts([problem], [start[None]], [row], silent)[0]


def fit_from(problems: Sequence[Problem], starts: Array) -> Minima:
    """Fit every trace from one starting point, and refine the optima by Newton steps.

    Parameters
    ----------
    problems
        One problem a trace.
    starts : (n_parameters,) or (n_traces, n_parameters)
        Log-parameters.

    Returns
    -------
    Minima
        The optimum of every trace.
    """
    return _fit_alike(problems, starts, refine_optima, FINE)


def descend_from(problems: Sequence[Problem], starts: Array) -> Minima:
    """Fit as `fit_from` does, but only to compare basins: less finely, without Newton steps."""
    return _fit_alike(problems, starts, lambda _, minima, __: minima, FAIR)


def _fit_alike(
    problems: Sequence[Problem],
    starts: Array,
    finish: Callable[[LocalFits, Minima, IntArray], Minima],
    tolerance: float,
) -> Minima:
    """Fit problems with the same responses together; each fit is then finished."""
    starts = np.broadcast_to(starts, (len(problems), len(problems[0].low)))
    groups, found = alike(problems), list[Minima]()
    for group in groups:
        fits, traces = LocalFits([problems[index] for index in group]), np.arange(len(group))
        found.append(finish(fits, fits.fitted(starts[group], traces, tolerance), traces))
    return Minima.joined(found)[np.argsort(np.concatenate(groups))]


def screened(misfit: Callable[[Array], Array], candidates: Array) -> tuple[Array, Array]:
    """Sort log-parameters by misfit, leaving out those without a response.

    Returns
    -------
    candidates : (n, n_parameters)
        Best first; equals, in single precision, in their given order.
    misfit_rad : (n,)
    """
    values = misfit(np.exp(candidates))
    order = np.argsort(values.astype(np.float32), kind="stable")
    order = order[np.isfinite(values[order])]
    return candidates[order], values[order]


def _best(found: Minima, which: BoolArray, count: int) -> IntArray:
    """Return the indices of the best fits among those that `which` marks."""
    chosen = np.flatnonzero(which)
    order = np.argsort(found.misfit_rad[chosen].astype(np.float32), kind="stable")
    best: IntArray = chosen[order[:count]]
    return best


def _descents(found: Minima, before: Row) -> list[Row]:
    """Return the rows of a history: the given first one, and one for each fit."""
    rows, evaluations, best, sorted_rad = [before], before[3], 0, list[float]()
    ranks = found.misfit_rad.astype(np.float32)
    for fit, misfit_rad in enumerate(found.misfit_rad.tolist()):
        evaluations += int(found.evaluations[fit])
        best = fit if ranks[fit] < ranks[best] else best
        insort(sorted_rad, misfit_rad)
        median = 0.5 * (sorted_rad[fit // 2] + sorted_rad[(fit + 1) // 2])
        rows.append((np.exp(found.x[best]), float(found.misfit_rad[best]), median, evaluations))
    return rows


def _answer_of(rows: list[Row], *, converged: bool) -> Identification:
    """Return an identification with a history, whose last row is its result."""
    parameters, misfit_rad, _, evaluations = rows[-1]
    steps, why = len(rows) - 1, "all starts fitted"
    return Identification(
        parameters, misfit_rad, steps, evaluations, why, History.of(rows), converged
    )
