"""The paper's genetic algorithm (section 4), with a setting for each detail left open there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray
from biogrip.fit.answer import History, Identification, Progress, silent
from biogrip.fit.genetic_operators import cross, mutate
from biogrip.fit.genetic_settings import GeneticSettings
from biogrip.fit.genome import Genome
from biogrip.fit.problem import Problem
from biogrip.fit.selection import Ranking, best
from biogrip.response.misfit import Misfits, combine_misfits


def identify_many(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Identification]:
    """Identify samples of one model by the paper's genetic algorithm.

    Individuals are ranked by their misfit in single precision; the chromosome breaks
    ties. Its 24 bits are far finer than noise can resolve, and far coarser than the
    differences between processors and BLAS libraries: the last bits of a misfit cannot
    change the course of the search.

    `progress` is called after every generation, for all problems together.
    """
    evolutions = evolve(problems, settings, rngs, progress)
    return [evolution.identification for evolution in evolutions]


@dataclass(frozen=True)
class Evolution:
    """The result of one run of the genetic algorithm, with its first and last survivors."""

    identification: Identification
    """Best individual and history."""
    first_survivors: Array
    """Parameters of the survivors of the initial population, best first, (n_survivors,
    n_parameters)."""
    last_survivors: Array
    """Those of the last population."""


def evolve(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Evolution]:
    """Identify samples as `identify_many` does, and return the survivors as well."""
    misfits = combine_misfits([problem.misfit for problem in problems])
    return evolve_many(misfits, problems[0].genome, settings, rngs, progress)


def evolve_many(
    misfits: Misfits,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Evolution]:
    """Run the genetic algorithm with one population for each random generator.

    Populations evolve side by side as arrays, independently of each other; those that
    have stopped are left out.

    Parameters
    ----------
    misfits
        Function of parameters, (n_populations, n, n_parameters), and of the indices of
        those populations, (n_populations,), that returns misfits.
    genome
        Encoding of the parameters.
    settings, rngs, progress
        As in `identify_many`, with a generator for each population.
    """
    running = np.arange(len(rngs))
    drawn = [genome.code(genome.draw(settings.population, rng)) for rng in rngs]
    survivors = _evaluated(np.stack(drawn, axis=1), misfits, genome, running)
    survivors = survivors.best(settings.survivors)
    first, last = survivors.codes, survivors.codes.copy()
    middle = settings.survivors // 2
    course = [(running, survivors.at(0, middle))]
    improved, stalled = np.zeros_like(running), np.zeros(len(rngs), dtype=bool)
    evaluations = settings.population * len(rngs)
    for generation in range(1, settings.max_generations + 1):
        waited = generation - 1 - improved[running] >= settings.patience
        if generation > settings.min_generations and waited.any():
            stalled[running[waited]] = True
            last[:, running] = survivors.codes
            running, survivors = running[~waited], survivors.only(~waited)
            if not len(running):
                break
        chosen = [rngs[population] for population in running.tolist()]
        children = cross(survivors.codes, genome, settings, chosen)
        before = survivors.ranking[:, 0]
        if generation >= settings.mutation_start:
            mutate(children, genome, settings, chosen)
            if settings.mutants == "all":
                others = np.ascontiguousarray(survivors.codes[:, :, 1:])
                mutate(others, genome, settings, chosen)
                evaluations += others[0].size
                others_now = _evaluated(others, misfits, genome, running)
                survivors = survivors.at(0).joined(others_now)
        everyone = survivors.joined(_evaluated(children, misfits, genome, running))
        survivors = everyone.best(settings.survivors)
        improved[running[survivors.ranking[:, 0] < before]] = generation
        course.append((running, survivors.at(0, middle)))
        evaluations += children[0].size
        progress(evaluations, float(survivors.ranking[:, 0].min()))
    last[:, running] = survivors.codes
    identifications = _identifications(course, stalled, genome, settings)
    survived = genome.parameters(first), genome.parameters(last)
    return [Evolution(*each) for each in zip(identifications, *survived, strict=True)]


@dataclass(frozen=True)
class _Populations:
    """Individuals of populations with the misfits by which they are ranked."""

    codes: IntArray
    """(n_words, n_populations, n)."""
    ranking: Ranking
    """(n_populations, n)."""

    def joined(self, other: "_Populations") -> "_Populations":
        return _Populations(
            np.concatenate((self.codes, other.codes), axis=2),
            np.concatenate((self.ranking, other.ranking), axis=1),
        )

    def at(self, *places: int) -> "_Populations":
        # Copies, for a view would keep the whole array in memory.
        return _Populations(self.codes.take(places, axis=2), self.ranking.take(places, axis=1))

    def only(self, which: NDArray[np.bool_]) -> "_Populations":
        return _Populations(self.codes[:, which], self.ranking[which])

    def best(self, count: int) -> "_Populations":
        return _Populations(*best(self.codes, self.ranking, count))


def _evaluated(
    codes: IntArray, misfits: Misfits, genome: Genome, running: IntArray
) -> _Populations:
    """Compute the misfits of chromosomes, keeping their order."""
    # A misfit is not negative, but a NaN has either sign.
    ranking = np.abs(misfits(genome.parameters(codes), running).astype(np.float32))
    return _Populations(codes, ranking)


def _identifications(
    course: Sequence[tuple[IntArray, _Populations]],
    stalled: NDArray[np.bool_],
    genome: Genome,
    settings: GeneticSettings,
) -> list[Identification]:
    """Collect each population's history from the best and middle survivors of generations."""
    running = np.concatenate([populations for populations, _ in course])
    codes = np.concatenate([kept.codes[:, :, 0] for _, kept in course], axis=1)
    best_misfit, median_misfit = np.concatenate([kept.ranking for _, kept in course]).T
    found = []
    for population, has_stalled in enumerate(stalled):
        own = np.flatnonzero(running == population)
        history = History(
            best_misfit[own].astype(float),
            median_misfit[own].astype(float),
            genome.parameters(codes[:, own]),
            _evaluations(settings, len(own)),
        )
        parameters, misfit_rad = history.best_parameters[-1], float(history.best_misfit[-1])
        evaluations = int(history.evaluations[-1])
        why = "stalled" if has_stalled else "generation limit"
        steps = len(own) - 1
        found.append(Identification(parameters, misfit_rad, steps, evaluations, why, history))
    return found


def _evaluations(settings: GeneticSettings, generations: int) -> IntArray:
    """Return the number of misfits computed up to each generation, (n_generations,)."""
    number = np.arange(generations)
    counts = settings.population + (settings.population - settings.survivors) * number
    if settings.mutants == "all":
        counts += (settings.survivors - 1) * np.maximum(number - settings.mutation_start + 1, 0)
    return counts
