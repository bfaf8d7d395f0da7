"""SciPy's differential evolution on log-parameters, which evaluates a generation at once.

References
----------
.. [1] R. Storn and K. Price, Journal of Global Optimization 11 (1997), 341-359.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.fit.problem import Fit, History, HistoryRow, ReportProgress, TraceProblem, silent
from biogrip.keys import Block
from biogrip_study.methods.misfit import make_misfit


@dataclass(frozen=True)
class DifferentialEvolutionSettings(Block):
    """SciPy's differential evolution, on the logarithms of the parameters."""

    popsize: Annotated[int, Field(ge=2, le=10_000)]
    """Individuals per parameter."""
    maxiter: Annotated[int, Field(ge=1, le=1_000_000)]
    """Generations at most."""
    tol: Annotated[float, Field(gt=0, le=1)]
    """Stop when the population's misfits scatter by less than this share of their mean."""


def identify_many(
    problems: Sequence[TraceProblem],
    settings: DifferentialEvolutionSettings,
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress = silent,
) -> list[Fit]:
    """Identify samples one after the other by SciPy's differential evolution.

    Individuals are ranked by their misfit in single precision, as by the genetic algorithm.
    `progress` is called after every generation of each.
    """
    pairs = zip(problems, rngs, strict=True)
    return [_identified(problem, settings, rng, progress) for problem, rng in pairs]


def _identified(
    problem: TraceProblem,
    settings: DifferentialEvolutionSettings,
    rng: np.random.Generator,
    progress: ReportProgress,
) -> Fit:
    from scipy.optimize import Bounds, differential_evolution

    rows: list[HistoryRow] = []
    misfit = make_misfit(problem.residuals)
    evaluations = 0

    def ranking(columns: Array) -> Array:
        nonlocal evaluations
        evaluations += columns.shape[1]
        return misfit(np.exp(columns.T)).astype(np.float32).astype(float)

    def row_of(result: Any) -> HistoryRow:
        median = float(np.median(result.population_energies))
        return np.exp(result.x), float(result.fun), median, evaluations

    def record(intermediate_result: Any) -> None:
        rows.append(row_of(intermediate_result))
        progress(evaluations, rows[-1][1])

    found = differential_evolution(
        ranking,
        Bounds(problem.low, problem.high),
        popsize=settings.popsize,
        maxiter=settings.maxiter,
        tol=settings.tol,
        rng=rng,
        callback=record,
        polish=False,
        updating="deferred",
        vectorized=True,
    )
    rows.append(final := row_of(found))
    why = "converged" if found.success else "generation limit"
    return Fit(*final[:2], int(found.nit), evaluations, why, History.of(rows))
