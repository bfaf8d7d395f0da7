"""Traces with the starting points that every fitter gets, and our fits from them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.setup import Problem, posed_together
from biogrip.arrays import Array
from biogrip.identify.answer import Row, silent
from biogrip.identify.multi_start import best_of_starts, screened
from biogrip.identify.problem import Problem as Posed
from biogrip.response.condensed import Condensed


@dataclass(frozen=True)
class Started:
    """A trace, and where its fits start.

    Parameters
    ----------
    case_problem
        What is fitted.
    starts : (n_starts, n_parameters)
        Log-parameters.
    before
        First row of the history, see `best_of_starts`.
    """

    case_problem: Posed
    starts: Array
    before: Row


def started(problems: Sequence[Problem], condensed: Condensed | None = None) -> list[Started]:
    """Choose starting points as the study's least squares does, from the best of random ones."""
    found = []
    settings: Any = problems[0].settings.method("least_squares")
    for seed, case_problem in enumerate(posed_together(problems, condensed)):
        rng = np.random.default_rng(seed)
        shape = (settings.candidates, len(case_problem.low))
        points, misfit = screened(
            case_problem.misfit, rng.uniform(case_problem.low, case_problem.high, shape)
        )
        before = np.exp(points[0]), float(misfit[0]), float(np.median(misfit)), len(points)
        found.append(Started(case_problem, points[: settings.starts], before))
    return found


def fitted(traces: Sequence[Started]) -> Array:
    """Fit traces side by side as the study does; log-parameters, (n_traces, n_parameters)."""
    answers = best_of_starts(
        [trace.case_problem for trace in traces],
        [trace.starts for trace in traces],
        [trace.before for trace in traces],
        silent,
    )
    return np.log([answer.parameters for answer in answers])
