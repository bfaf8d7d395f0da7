"""SciPy's differential evolution on log-parameters, a whole generation evaluated at once.

References
----------
.. [1] R. Storn and K. Price, Differential evolution: a simple and efficient heuristic for
   global optimization over continuous spaces, Journal of Global Optimization 11 (1997),
   341-359.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.identify.answer import History, Identification, Progress, silent
from biogrip.identify.problem import Problem
from biogrip.keys import Key

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult


@dataclass(frozen=True)
class DifferentialEvolutionSettings:
    """SciPy's differential evolution, on the logarithms of the parameters."""

    popsize: Annotated[int, Key("Individuals per parameter.", low=2, high=10_000)]
    maxiter: Annotated[int, Key("Generations at most.", low=1, high=1_000_000)]
    tol: Annotated[
        float,
        Key(
            "Stop when the population's misfits scatter by less than this share of their mean.",
            above=0,
            high=1,
        ),
    ]


def identify(
    problem: Problem,
    settings: DifferentialEvolutionSettings,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Identification:
    """Identify a sample with differential evolution; a step is a generation.

    Individuals are ranked on their misfit in single precision, as in `biogrip.identify.genetic`.

    Parameters
    ----------
    problem
        What is identified.
    settings
        Its budget.
    rng
        The only source of randomness.
    progress
        Is told after every generation.
    """
    from scipy.optimize import Bounds, differential_evolution

    rows: list[tuple[Array, float, float, int]] = []
    evaluations = 0

    def ranking(columns: Array) -> Array:
        nonlocal evaluations
        evaluations += columns.shape[1]
        return problem.misfit(np.exp(columns.T)).astype(np.float32).astype(float)

    def record(intermediate_result: "OptimizeResult") -> None:
        lowest, middle = (
            float(intermediate_result.fun),
            float(np.median(intermediate_result.population_energies)),
        )
        rows.append((np.exp(intermediate_result.x), lowest, middle, evaluations))
        progress(evaluations, lowest)

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
    final = np.exp(found.x), float(found.fun), float(np.median(found.population_energies))
    rows.append((*final, evaluations))
    parameters, best_misfit, median_misfit, counts = zip(*rows, strict=True)
    history = History(
        np.array(best_misfit),
        np.array(median_misfit),
        np.array(parameters),
        np.array(counts, dtype=np.int64),
    )
    return Identification(
        history.best_parameters[-1],
        float(found.fun),
        int(found.nit),
        evaluations,
        "converged" if found.success else "generation limit",
        history,
    )
