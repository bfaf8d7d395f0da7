"""The best of several local fits, for many traces at once.

`biogrip.identify.multi_start` for all traces of a batch: the same starts, the same
choice among the fits, the same histories. To the last bit, the answer for a trace
does not depend on which others there are.
"""

from bisect import insort
from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.identify import local_fit
from biogrip.identify.answer import Identification, Progress
from biogrip.identify.levenberg_marquardt import Minima
from biogrip.identify.local_fit import ROUGH
from biogrip.identify.many_fits import ManyFits, fit_together
from biogrip.identify.multi_start import FINISHED, Row, answer_of, best_of_starts
from biogrip.identify.problem import Problem
from biogrip.identify.settling import settled


def best_of_many_starts(
    problems: Sequence[Problem],
    starts: Sequence[Array],
    before: Sequence[Row],
    progress: Progress,
) -> list[Identification]:
    """Fit every trace from each of its starts; the answers are the optima of lowest misfit.

    Where `fit_together` does not agree, the traces are fitted one by one.

    Parameters
    ----------
    problems
        What is fitted, one a trace.
    starts
        Log-parameters for each trace, (n_starts, n_parameters).
    before
        First row of the history of each trace, see `best_of_starts`.
    progress
        Is told after every trace.
    """
    if not fit_together(problems):
        return [
            best_of_starts(problem, own_starts, row, progress)
            for problem, own_starts, row in zip(problems, starts, before, strict=True)
        ]
    fits, traces = ManyFits(problems), np.arange(len(problems))
    trace = np.repeat(traces, [len(own_starts) for own_starts in starts])
    rough = fits.fitted(np.concatenate(starts), trace, ROUGH)
    finalists = np.concatenate([_best(rough, trace == own, FINISHED) for own in traces])
    fine = fits.fitted(rough.x[finalists], trace[finalists])
    winners = np.concatenate([_best(fine, trace[finalists] == own, 1) for own in traces])
    best = settled(fits, fine.of(winners), traces)
    answers = []
    for own, first_row in enumerate(before):
        rows = _descents(rough.of(np.flatnonzero(trace == own)), first_row)
        # Not the steps that settle it: how many it takes, the last bits of a processor decide.
        finished = fine.evaluations[trace[finalists] == own].sum()
        misfit_rad, evaluations = float(best.misfit_rad[own]), rows[-1][3] + int(finished)
        rows[-1] = np.exp(best.x[own]), misfit_rad, misfit_rad, evaluations
        progress(evaluations, misfit_rad)
        answers.append(answer_of(rows))
    return answers


def fitted_from(problems: Sequence[Problem], start: Array) -> Array:
    """Fit every trace from one starting point, and settle the optima.

    Parameters
    ----------
    problems
        What is fitted, one a trace.
    start : (n_parameters,)
        Log-parameters.

    Returns
    -------
    (n_traces, n_parameters)
        Log-parameters of the optima.
    """
    if not fit_together(problems):
        fits_alone = [
            local_fit.settled(each, local_fit.local_fit(each, start)) for each in problems
        ]
        return np.array([fit.log_parameters for fit in fits_alone])
    fits, traces = ManyFits(problems), np.arange(len(problems))
    starts = np.broadcast_to(start, (len(problems), len(start)))
    return settled(fits, fits.fitted(starts, traces), traces).x


def _best(found: Minima, which: BoolArray, count: int) -> IntArray:
    """Indices of the best fits, ranked as in `best_of_starts`."""
    chosen = np.flatnonzero(which)
    order = np.argsort(found.misfit_rad[chosen].astype(np.float32), kind="stable")
    best: IntArray = chosen[order[:count]]
    return best


def _descents(found: Minima, before: Row) -> list[Row]:
    """Rows of a history: the first, and one for each fit."""
    rows, evaluations, best, sorted_rad = [before], before[3], 0, list[float]()
    ranks = found.misfit_rad.astype(np.float32)
    for fit, misfit_rad in enumerate(found.misfit_rad.tolist()):
        evaluations += int(found.evaluations[fit])
        best = fit if ranks[fit] < ranks[best] else best
        insort(sorted_rad, misfit_rad)
        median = 0.5 * (sorted_rad[fit // 2] + sorted_rad[(fit + 1) // 2])
        rows.append((np.exp(found.x[best]), float(found.misfit_rad[best]), median, evaluations))
    return rows
