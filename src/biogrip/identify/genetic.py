"""The paper's genetic algorithm (section 4), every reading of it a setting."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.identify.answer import History, Identification, Progress, silent
from biogrip.identify.genome import Genome
from biogrip.identify.problem import Problem


@dataclass(frozen=True)
class GeneticSettings:
    """How the population evolves.

    Parameters
    ----------
    population
        Individuals in a generation.
    survivors
        The best so many live on unchanged and are the parents.
    mating
        ``"pairs"``: the survivors form random disjoint pairs; ``"rank"``:
        parents are drawn with a probability proportional to their rank.
    first_cut, last_cut
        Crossover point: the number of genes kept from the first parent is drawn
        uniformly from this range. Negative numbers count from the end: -1 is one
        less than the chromosome has.
    mutation_start
        First generation in which children mutate.
    mutation_probability
        Share of children that mutate.
    mutated_genes
        Genes redrawn in a child that mutates.
    patience
        Stop after so many generations without a better best misfit.
    min_generations, max_generations
        Never stop before, always stop at.
    """

    population: int
    survivors: int
    mating: str
    first_cut: int
    last_cut: int
    mutation_start: int
    mutation_probability: float
    mutated_genes: int
    patience: int
    min_generations: int
    max_generations: int


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
    return evolve(problem.misfit, problem.genome, settings, rng, progress).identification


def settings_of(blocks: Mapping[str, Any]) -> GeneticSettings:
    """Build the settings from the config's ``genetic_algorithm`` block."""
    return GeneticSettings(**blocks["genetic_algorithm"])


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


def evolve(
    misfit: Callable[[Array], Array],
    genome: Genome,
    settings: GeneticSettings,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Evolution:
    """Run the algorithm on any misfit of parameters of shape (n, n_parameters)."""
    drawn = _evaluated(genome.draw(settings.population, rng), misfit, genome)
    first = survivors = drawn.best(settings.survivors)
    evaluations = settings.population
    rows = [_record(survivors, evaluations)]
    generation = improved = 0
    while True:
        if generation >= settings.max_generations:
            reason = "generation limit"
            break
        if generation >= settings.min_generations and generation - improved >= settings.patience:
            reason = "stalled"
            break
        generation += 1
        children = _cross(survivors.chromosomes, settings, rng)
        if generation >= settings.mutation_start:
            _mutate(children, genome, settings, rng)
        evaluations += len(children)
        best = survivors.ranking[0]
        everyone = survivors.joined(_evaluated(children, misfit, genome))
        survivors = everyone.best(settings.survivors)
        if survivors.ranking[0] < best:
            improved = generation
        rows.append(_record(survivors, evaluations))
        progress(evaluations, float(survivors.ranking[0]))
    chromosomes, best_misfit, median_misfit, counts = zip(*rows, strict=True)
    history = History(
        np.array(best_misfit),
        np.array(median_misfit),
        genome.decode(np.array(chromosomes)),
        np.array(counts, dtype=np.int64),
    )
    answer = Identification(
        history.best_parameters[-1],
        float(history.best_misfit[-1]),
        generation,
        evaluations,
        reason,
        history,
    )
    return Evolution(answer, genome.decode(first.chromosomes), genome.decode(survivors.chromosomes))


@dataclass(frozen=True)
class _Population:
    """Individuals with what they are ranked on."""

    chromosomes: IntArray
    codes: IntArray
    ranking: np.ndarray[tuple[int], np.dtype[np.float32]]

    def joined(self, other: "_Population") -> "_Population":
        return _Population(
            np.concatenate((self.chromosomes, other.chromosomes)),
            np.concatenate((self.codes, other.codes), axis=1),
            np.concatenate((self.ranking, other.ranking)),
        )

    def best(self, count: int) -> "_Population":
        """Best first; ties in the order of the chromosomes' codes."""
        order = np.lexsort((*self.codes[::-1], self.ranking))[:count]
        return _Population(
            self.chromosomes.take(order, axis=0),
            self.codes.take(order, axis=1),
            self.ranking[order],
        )


def _evaluated(
    chromosomes: IntArray, misfit: Callable[[Array], Array], genome: Genome
) -> _Population:
    """Individuals in the order they come in."""
    ranking = misfit(genome.decode(chromosomes)).astype(np.float32)
    return _Population(chromosomes, genome.code(chromosomes), ranking)


def _record(survivors: _Population, evaluations: int) -> tuple[IntArray, float, float, int]:
    ranking = survivors.ranking
    median = float(ranking[len(ranking) // 2])
    return survivors.chromosomes[0], float(ranking[0]), median, evaluations


def _cross(parents: IntArray, settings: GeneticSettings, rng: np.random.Generator) -> IntArray:
    """Single-point crossover; both children of a pair are kept."""
    wanted = settings.population - settings.survivors
    pairs = -(-wanted // 2)
    if settings.mating == "rank":
        rank = np.arange(len(parents), 0, -1)
        drawn = rng.choice(len(parents), size=(pairs, 2), p=rank / rank.sum())
    else:
        rounds = -(-2 * pairs // (len(parents) // 2 * 2))
        shuffled = [rng.permutation(len(parents))[: len(parents) // 2 * 2] for _ in range(rounds)]
        drawn = np.concatenate(shuffled)[: 2 * pairs].reshape(pairs, 2)
    genes = parents.shape[1]
    first, last = (
        min(cut if cut > 0 else genes + cut, genes - 1)
        for cut in (settings.first_cut, settings.last_cut)
    )
    cut = rng.integers(min(first, last), last, size=(pairs, 1), endpoint=True)
    mated = parents.take(drawn.T, axis=0)
    children = np.where(np.arange(genes) < cut, mated, mated[::-1])
    return children.reshape(2 * pairs, genes)[:wanted]


def _mutate(
    children: IntArray,
    genome: Genome,
    settings: GeneticSettings,
    rng: np.random.Generator,
) -> None:
    """Redraw genes of some children in place."""
    chosen = np.flatnonzero(rng.random(len(children)) < settings.mutation_probability)
    for _ in range(settings.mutated_genes):
        gene = rng.integers(genome.genes, size=len(chosen))
        children[chosen, gene] = rng.integers(genome.low[gene], genome.high[gene], endpoint=True)
