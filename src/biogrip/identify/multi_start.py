"""Local fits from several starting points, and the best of them.

References
----------
.. [1] A. Raue et al., Lessons learned from quantitative dynamical modeling in systems biology,
   PLoS ONE 8 (2013), e74335: local fits from many starts.
"""

from collections.abc import Callable, Iterable

import numpy as np

from biogrip.arrays import Array
from biogrip.identify.answer import History, Identification, Progress, silent
from biogrip.identify.local_fit import ROUGH, LocalFit, local_fit, settled
from biogrip.identify.problem import Problem

FINISHED = 4
"""Of the rough fits, so many of the best are finished."""

Row = tuple[Array, float, float, int]
"""Of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def best_of_starts(
    problem: Problem,
    starts: Iterable[Array],
    before: Row,
    progress: Progress,
) -> Identification:
    """Fit from every start; the answer is the optimum of lowest misfit, settled.

    Misfits are compared in single precision and the first of equals wins, so
    that the last bits of a processor decide nothing.

    Parameters
    ----------
    problem
        What is fitted.
    starts
        Log-parameters, (n_parameters,) each.
    before
        First row of the history: parameters, lowest and median misfit, and
        evaluations before the first fit.
    progress
        Is told after every fit.
    """
    rows, evaluations = [before], before[3]
    found: list[LocalFit] = []
    for start in starts:
        found.append(local_fit(problem, start, ROUGH))
        evaluations += found[-1].evaluations
        rows.append(_row(found, evaluations))
        progress(evaluations, rows[-1][1])
    # Which basin is deepest shows before its bottom is reached; only the best are worth that.
    found = [
        local_fit(problem, rough.log_parameters) for rough in sorted(found, key=_rank)[:FINISHED]
    ]
    best = settled(problem, min(found, key=_rank))
    # Not the steps that settle it: how many it takes, the last bits of a processor decide.
    evaluations += sum(fine.evaluations for fine in found)
    rows[-1] = _row([best], evaluations)
    return answer_of(rows)


def answer_of(rows: list[Row]) -> Identification:
    """Return the last row of a history as the answer."""
    parameters, best_misfit, median_misfit, counts = zip(*rows, strict=True)
    history = History(
        np.array(best_misfit),
        np.array(median_misfit),
        np.array(parameters),
        np.array(counts, dtype=np.int64),
    )
    return Identification(
        history.best_parameters[-1],
        best_misfit[-1],
        len(rows) - 1,
        counts[-1],
        "all starts fitted",
        history,
    )


def _rank(found: LocalFit) -> np.float32:
    return np.float32(found.misfit_rad)


def _row(found: list[LocalFit], evaluations: int) -> Row:
    best = min(found, key=_rank)
    median = float(np.median([fit.misfit_rad for fit in found]))
    return np.exp(best.log_parameters), best.misfit_rad, median, evaluations


def fitted_from(problem: Problem, start: Array) -> Identification:
    """Fit from a single point, (n_parameters,) log-parameters."""
    misfit = float(problem.misfit(np.exp(start)[None])[0])
    return best_of_starts(problem, [start], (np.exp(start), misfit, misfit, 1), silent)


def screened(misfit: Callable[[Array], Array], candidates: Array) -> tuple[Array, Array]:
    """Sort log-parameters by misfit, those without one left out.

    Returns
    -------
    candidates : (n, n_parameters)
        Best first; equals, in single precision, in the order they came.
    misfit_rad : (n,)
    """
    values = misfit(np.exp(candidates))
    order = np.argsort(values.astype(np.float32), kind="stable")
    order = order[np.isfinite(values[order])]
    return candidates[order], values[order]
