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
from biogrip.response.misfit import Misfit, Misfits, together


def identify(
    problem: Problem,
    settings: GeneticSettings,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Identification:
    """Identify a sample with the genetic algorithm; a step is a generation.

    Individuals are ranked on their misfit in single precision, ties broken by
    the chromosome. Its 24 bits are far finer than noise can tell apart, and far
    coarser than what differs between processors and BLAS libraries: the last
    bits of a misfit cannot change which trajectory is taken.

    Parameters
    ----------
    problem
        What is identified.
    settings
        How the population evolves.
    rng
        The only source of randomness.
    progress
        Is told after every generation.
    """
    return identify_many([problem], settings, [rng], progress)[0]


def identify_many(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Identification]:
    """Identify samples side by side; each answer is, to the bit, that of `identify`.

    Parameters
    ----------
    problems
        What is identified; all have the same genome.
    settings
        How each population evolves.
    rngs
        The only source of randomness of each problem.
    progress
        Is told after every generation, of all problems together.
    """
    evolutions = evolve_problems(problems, settings, rngs, progress)
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


def evolve_problems(
    problems: Sequence[Problem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Evolution]:
    """Run the algorithm on problems side by side; arguments as of `identify_many`."""
    misfits = together([problem.misfit for problem in problems])
    return evolve_many(misfits, problems[0].genome, settings, rngs, progress)


def evolve(
    misfit: Misfit,
    genome: Genome,
    settings: GeneticSettings,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Evolution:
    """Run the algorithm on any misfit of parameters of shape (n, n_parameters)."""
    return evolve_many(together([misfit]), genome, settings, [rng], progress)[0]


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
    settings
        How each population evolves.
    rngs
        The only source of randomness of each population.
    progress
        Is told after every generation, of all populations together.
    """
    running = np.arange(len(rngs))
    drawn = [genome.code(genome.draw(settings.population, rng)) for rng in rngs]
    survivors = _evaluated(np.stack(drawn, axis=1), misfits, genome, running)
    survivors = survivors.best(settings.survivors)
    first, last = survivors.codes, survivors.codes.copy()
    course = [_Generation.of(running, survivors)]
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
                survivors = survivors.first().joined(others_now)
        everyone = survivors.joined(_evaluated(children, misfits, genome, running))
        survivors = everyone.best(settings.survivors)
        improved[running[survivors.ranking[:, 0] < before]] = generation
        course.append(_Generation.of(running, survivors))
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

    def first(self) -> "_Populations":
        return _Populations(self.codes[:, :, :1], self.ranking[:, :1])

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


@dataclass(frozen=True)
class _Generation:
    """What is kept of a generation.

    Parameters
    ----------
    running : (n_populations,)
        Indices of those that have not stopped.
    best_codes : (n_words, n_populations)
    best_misfit, median_misfit : (n_populations,)
        Of the survivors.
    """

    running: IntArray
    best_codes: IntArray
    best_misfit: Ranking
    median_misfit: Ranking

    @classmethod
    def of(cls, running: IntArray, survivors: _Populations) -> "_Generation":
        codes, ranking = survivors.codes, survivors.ranking
        middle = ranking.shape[1] // 2
        # Copies, for a part of an array keeps all of it.
        return cls(running, codes[:, :, 0].copy(), ranking[:, 0].copy(), ranking[:, middle].copy())


def _identifications(
    course: Sequence[_Generation],
    stalled: NDArray[np.bool_],
    genome: Genome,
    settings: GeneticSettings,
) -> list[Identification]:
    """Sort the generations of all populations into what each of them went through."""
    running = np.concatenate([generation.running for generation in course])
    codes = np.concatenate([generation.best_codes for generation in course], axis=1)
    best_misfit = np.concatenate([generation.best_misfit for generation in course])
    median_misfit = np.concatenate([generation.median_misfit for generation in course])
    found = []
    for population, has_stalled in enumerate(stalled):
        own = np.flatnonzero(running == population)
        history = History(
            best_misfit[own].astype(float),
            median_misfit[own].astype(float),
            genome.parameters(codes[:, own]),
            _evaluations(settings, len(own)),
        )
        found.append(
            Identification(
                history.best_parameters[-1],
                float(history.best_misfit[-1]),
                len(own) - 1,
                int(history.evaluations[-1]),
                "stalled" if has_stalled else "generation limit",
                history,
            )
        )
    return found


def _evaluations(settings: GeneticSettings, generations: int) -> IntArray:
    """Misfits computed up to each generation, (n_generations,)."""
    number = np.arange(generations)
    counts = settings.population + (settings.population - settings.survivors) * number
    if settings.mutants == "all":
        counts += (settings.survivors - 1) * np.maximum(number - settings.mutation_start + 1, 0)
    return counts
