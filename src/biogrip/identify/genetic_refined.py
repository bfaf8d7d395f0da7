"""The genetic algorithm, its survivors polished on log-parameters.

The last survivors crowd in one basin. The survivors of the initial population
are still everywhere, so local fits start from the best of both.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.identify import genetic
from biogrip.identify.answer import History, Identification, Progress, silent
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.multi_start import Row, best_of_starts
from biogrip.identify.problem import Problem
from biogrip.keys import Key


@dataclass(frozen=True)
class Polishing:
    """Local fits from survivors of the genetic algorithm."""

    first: Annotated[
        int,
        Key(
            "How many survivors of the initial population are polished, the best.",
            low=0,
            high=10_000,
        ),
    ]
    last: Annotated[int, Key("The same of the last population.", low=1, high=10_000)]


@dataclass(frozen=True)
class RefinedSettings:
    """The genetic algorithm's settings, and how many survivors are polished.

    Parameters
    ----------
    genetic
        How the population evolves.
    polishing
        How many local fits follow.
    """

    genetic: GeneticSettings
    polishing: Polishing


def identify(
    problem: Problem,
    settings: RefinedSettings,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Identification:
    """Identify a sample with the genetic algorithm and local fits from its survivors.

    A step is a generation, and after them a fit.

    Parameters
    ----------
    problem
        What is identified.
    settings
        Its budget.
    rng
        The only source of randomness.
    progress
        Is told after every generation and every fit.
    """
    return identify_many([problem], settings, [rng], progress)[0]


def identify_many(
    problems: Sequence[Problem],
    settings: RefinedSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Identification]:
    """Identify samples whose populations evolve side by side; each answer is that of `identify`.

    Parameters
    ----------
    problems
        What is identified; all have the same genome.
    settings
        The budget of each.
    rngs
        The only source of randomness of each problem.
    progress
        Is told after every generation, of all problems together, and in the end once for each.
    """
    evolutions = genetic.evolve_problems(problems, settings.genetic, rngs, progress)
    starts, before = zip(*(_survivors(each, settings) for each in evolutions), strict=True)
    fine = best_of_starts(problems, starts, before, progress)
    coarse = [evolution.identification for evolution in evolutions]
    return [_polished(*both) for both in zip(coarse, fine, strict=True)]


def _survivors(evolution: genetic.Evolution, settings: RefinedSettings) -> tuple[Array, Row]:
    """Return the fits' starts, log-parameters, and the first row of their history."""
    coarse = evolution.identification
    starts = np.concatenate(
        (
            evolution.last_survivors[: settings.polishing.last],
            evolution.first_survivors[: settings.polishing.first],
        )
    )
    median = float(coarse.history.median_misfit[-1])
    before = coarse.parameters, coarse.misfit_rad, median, coarse.evaluations
    return np.log(starts), before


def _polished(coarse: Identification, fine: Identification) -> Identification:
    return Identification(
        fine.parameters,
        fine.misfit_rad,
        coarse.generations + fine.generations,
        fine.evaluations,
        f"{coarse.stop_reason}, polished",
        _joined(coarse.history, fine.history),
        fine.converged,
    )


def _joined(coarse: History, fine: History) -> History:
    """Append the fits to the generations; the fits' first row repeats the last generation."""
    return History(
        np.concatenate((coarse.best_misfit, fine.best_misfit[1:])),
        np.concatenate((coarse.median_misfit, fine.median_misfit[1:])),
        np.concatenate((coarse.best_parameters, fine.best_parameters[1:])),
        np.concatenate((coarse.evaluations, fine.evaluations[1:])),
    )
