"""The paper's genetic algorithm (section 4), every reading of it a setting."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray
from biogrip.identify.answer import History, Identification, Progress, silent
from biogrip.identify.genetic_operators import cross, mutate
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.genome import Genome
from biogrip.identify.problem import Problem
from biogrip.identify.selection import Ranking, best
from biogrip.response.misfit import Misfits, together


def identify_many(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Identification]:
    """Identify samples of one genome, as `biogrip.identify.methods` says.

    Individuals are ranked on their misfit in single precision, ties broken by
    the chromosome. Its 24 bits are far finer than noise can tell apart, and far
    coarser than what differs between processors and BLAS libraries: the last
    bits of a misfit cannot change which trajectory is taken.

    Progress is told after every generation, of all problems together.
    """
    evolutions = evolved(problems, settings, rngs, progress)
    return [evolution.identification for evolution in evolutions]


@dataclass(frozen=True)
class Evolution:
    """A run of the algorithm with the survivors that others start from.

    Parameters
    ----------
    identification
        Its answer.
    first_survivors, last_survivors : (n_survivors, n_parameters)
        Parameters of the survivors of the initial and of the last population, best first.
    """

    identification: Identification
    first_survivors: Array
    last_survivors: Array


def evolved(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Evolution]:
    """Identify as `identify_many` does, and return the survivors as well."""
    misfits = together([problem.misfit for problem in problems])
    return evolve_many(misfits, problems[0].genome, settings, rngs, progress)


def evolve_many(
    misfits: Misfits,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Evolution]:
    """Run the algorithm with a population for each generator.

    Populations evolve side by side as arrays and know nothing of each other; those
    that have stopped are left out.

    Parameters
    ----------
    misfits
        Of parameters of shape (n_populations, n, n_parameters), and of the indices of
        those populations, (n_populations,).
    genome
        What a chromosome may be.
    settings, rngs, progress
        As of `identify_many`, with a generator for each population.
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
    """Individuals with what they are ranked on.

    Parameters
    ----------
    codes : (n_words, n_populations, n)
    ranking : (n_populations, n)
    """

    codes: IntArray
    ranking: Ranking

    def joined(self, other: "_Populations") -> "_Populations":
        return _Populations(
            np.concatenate((self.codes, other.codes), axis=2),
            np.concatenate((self.ranking, other.ranking), axis=1),
        )

    def at(self, *places: int) -> "_Populations":
        # Copies, for a part of an array keeps all of it.
        return _Populations(self.codes.take(places, axis=2), self.ranking.take(places, axis=1))

    def only(self, which: NDArray[np.bool_]) -> "_Populations":
        return _Populations(self.codes[:, which], self.ranking[which])

    def best(self, count: int) -> "_Populations":
        return _Populations(*best(self.codes, self.ranking, count))


def _evaluated(
    codes: IntArray, misfits: Misfits, genome: Genome, running: IntArray
) -> _Populations:
    """Individuals in the order they come in."""
    # A misfit is not negative, but what is not a number has either sign.
    ranking = np.abs(misfits(genome.parameters(codes), running).astype(np.float32))
    return _Populations(codes, ranking)


def _identifications(
    course: Sequence[tuple[IntArray, _Populations]],
    stalled: NDArray[np.bool_],
    genome: Genome,
    settings: GeneticSettings,
) -> list[Identification]:
    """Sort generations, the best and the middle survivor of all populations that run, by these."""
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
    """Misfits computed up to each generation, (n_generations,)."""
    number = np.arange(generations)
    counts = settings.population + (settings.population - settings.survivors) * number
    if settings.mutants == "all":
        counts += (settings.survivors - 1) * np.maximum(number - settings.mutation_start + 1, 0)
    return counts
