"""A search with a budget of model evaluations: what it has reached, and after how many."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.identify.answer import Identification
from biogrip.identify.problem import Problem


class Spent(Exception):
    """The budget is spent, or all aims are reached."""


class Search:
    """The search for the sample of one trace, which may take several runs of a method.

    Parameters
    ----------
    problem
        What is identified.
    scale_rad
        RMS of the trace; misfits over it are of order one, as general methods expect.
    budget
        Evaluations of the model at most.
    aims
        Misfits in rad to be reached, by name.
    """

    def __init__(
        self, problem: Problem, scale_rad: float, budget: int, aims: Mapping[str, float]
    ) -> None:
        self.problem = problem
        self.evaluations = 0
        self.lowest_rad = math.inf
        self.parameters = np.full(len(problem.low), np.nan)
        self.reached: dict[str, int] = {}
        self._scale_rad, self._budget, self._aims = scale_rad, budget, aims

    @property
    def over(self) -> bool:
        """True if the budget is spent, or all aims are reached."""
        return self.evaluations >= self._budget or len(self.reached) == len(self._aims)

    def misfit(self, log_parameters: Array) -> Array:
        """Return misfits over the trace's RMS, (n,), at log-parameters (n, n_parameters).

        Raises
        ------
        Spent
            If the search is over.
        """
        parameters = np.exp(log_parameters)
        misfits = self.problem.misfit(parameters)
        self.add(misfits, parameters, 1 + np.arange(len(misfits)))
        if self.over:
            raise Spent
        return misfits / self._scale_rad

    def add(self, misfits: Array, parameters: Array, evaluations: IntArray) -> None:
        """Add what a run has found after how many evaluations since the last, all (n, ...)."""
        since = self.evaluations
        self.evaluations += int(evaluations[-1])
        misfits = np.where(since + evaluations <= self._budget, misfits, np.inf)
        best = int(np.argmin(misfits))
        if misfits[best] < self.lowest_rad:
            self.lowest_rad, self.parameters = float(misfits[best]), parameters[best]
            for name, aim in self._aims.items():
                if name not in self.reached and self.lowest_rad <= aim:
                    first = int(np.argmax(misfits <= aim))
                    self.reached[name] = since + int(evaluations[first])

    def add_run(self, found: Identification) -> None:
        """Add a whole run of one of the study's methods."""
        history = found.history
        self.add(history.best_misfit, history.best_parameters, history.evaluations)


def evaluations_99(reached: Sequence[int], searches: int, budget: int) -> float | None:
    """Return after how many evaluations 99 % of searches have reached an aim.

    Where fewer have with the whole budget, searches are repeated: with their share p, ln 0.01/ln(1
    - p) budgets are needed. None if none has.

    Parameters
    ----------
    reached
        Evaluations after which those searches that have reached the aim did so.
    searches, budget
        Number of all, and evaluations of each.
    """
    needed = math.ceil(0.99 * searches)
    if len(reached) >= needed:
        return float(sorted(reached)[needed - 1])
    if not reached:
        return None
    return budget * math.log(0.01) / math.log1p(-len(reached) / searches)
