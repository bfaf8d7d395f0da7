"""The paper's genetic algorithm (section 4), with a setting for each detail left open there.

Each generation, the best individuals survive unchanged. They are the parents of the others by
single-point crossover, after which a share of the children has a gene redrawn. The search stops
when the best misfit has stalled. Individuals are ranked by their misfit in single precision; the
chromosome breaks ties. Its 24 bits are far finer than noise can resolve, and far coarser than the
differences between processors and BLAS libraries: the last bits of a misfit cannot change the
search.

The populations of several traces evolve side by side as arrays, (n_populations, n, n_genes). Each
has a random generator of its own, so that none depends on the others.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from biogrip.arrays import IntArray
from biogrip.fit.problem import Fit, History, HistoryRow, ReportProgress, TraceProblem, silent
from biogrip.keys import Block, Complaint
from biogrip_study.methods.genome import Chromosomes, Genome
from biogrip_study.methods.misfit import make_misfits

_LARGEST_SETTING = 1_000_000

Ranking = NDArray[np.float32]
"""Misfits by which individuals are ranked, (n_populations, n)."""


@dataclass(frozen=True)
class GeneticSettings(Block):
    """Settings of the genetic algorithm (section 4)."""

    population: Annotated[int, Field(ge=4, le=_LARGEST_SETTING)]
    """Individuals in a generation."""
    survivors: Annotated[int, Field(ge=2, le=_LARGEST_SETTING)]
    """Number of the best, which survive unchanged and are the parents of the others."""
    mating: Literal["pairs", "rank"]
    """`pairs`: survivors form random disjoint pairs; `rank`: parents are drawn with a probability
    proportional to their rank."""
    cut: Literal["once", "between", "each"]
    """`once`: one crossover cut, anywhere; `between`: one, between parameters; `each`: one in every
    parameter."""
    mutation_start: Annotated[int, Field(ge=1, le=_LARGEST_SETTING)]
    """First generation whose children mutate."""
    mutation_probability: Annotated[float, Field(ge=0, le=1)]
    """Share of the children that mutate."""
    mutated_genes: Annotated[int, Field(ge=1, le=50)]
    """Number of times that a gene of such a child is chosen and redrawn from its range."""
    patience: Annotated[int, Field(ge=1, le=_LARGEST_SETTING)]
    """Stop after this number of generations without improvement of the best misfit."""
    min_generations: Annotated[int, Field(ge=0, le=_LARGEST_SETTING)]
    """Fewest generations."""
    max_generations: Annotated[int, Field(ge=1, le=_LARGEST_SETTING)]
    """Most generations."""
    mutants: Literal["children", "all"] = "children"
    """Individuals that may mutate: `children`; or `all`, survivors except the best, too."""

    def complaints(self) -> Iterator[Complaint]:
        """Find settings that leave no children, or whose limits of generations conflict."""
        if self.survivors >= self.population:
            text = f"found {self.survivors}, allowed is less than population"
            yield ("survivors",), f"{text}, which is {self.population}."
        if self.min_generations > self.max_generations:
            text = f"found {self.min_generations}, allowed is at most max_generations"
            yield ("min_generations",), f"{text}, which is {self.max_generations}."


def identify_many(
    problems: Sequence[TraceProblem],
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress = silent,
) -> list[Fit]:
    """Identify samples of one model by the paper's genetic algorithm, all at once.

    Parameters
    ----------
    problems, rngs
        Problem of each trace, and the random numbers of its population.
    settings
        Config block of the algorithm.
    progress
        Told of the number of responses and the lowest misfit after each generation.

    Returns
    -------
    list of Fit
        That of each trace.
    """
    misfits = make_misfits([problem.residuals for problem in problems])
    genome = Genome(problems[0].ranges)

    def ranked(chromosomes: Chromosomes, populations: IntArray) -> Ranking:
        misfit = misfits(genome.decode(chromosomes), populations).astype(np.float32)
        # A misfit is not negative, but a NaN has either sign.
        return np.abs(misfit)

    def record() -> None:
        best = genome.decode(survivors[:, 0])
        lowest, median = (ranking[:, at].tolist() for at in (0, settings.survivors // 2))
        for row, population in enumerate(running.tolist()):
            courses[population].append((best[row], lowest[row], median[row], evaluations))

    # Populations that have stopped are left out.
    running = np.arange(len(rngs))
    drawn = [genome.draw(settings.population, rng) for rng in rngs]
    # In single bytes, which sorting and crossover copy in half of the time.
    everyone: Chromosomes = np.stack(drawn).astype(np.int8)
    survivors, ranking = select(everyone, ranked(everyone, running), settings.survivors)
    improved = np.zeros_like(running)
    courses: list[list[HistoryRow]] = [[] for _ in rngs]
    evaluations = settings.population
    record()
    for generation in range(1, settings.max_generations + 1):
        waited = generation - 1 - improved[running] >= settings.patience
        if generation > settings.min_generations and waited.any():
            running, survivors, ranking = running[~waited], survivors[~waited], ranking[~waited]
            if not len(running):
                break
        rngs_running = [rngs[population] for population in running.tolist()]
        children, before = cross(survivors, genome, settings, rngs_running), ranking[:, 0]
        if generation >= settings.mutation_start:
            mutate(children, genome, settings, rngs_running)
            if settings.mutants == "all":
                others = survivors[:, 1:].copy()
                mutate(others, genome, settings, rngs_running)
                children = np.concatenate((children, others), axis=1)
                survivors, ranking = survivors[:, :1], ranking[:, :1]
        everyone = np.concatenate((survivors, children), axis=1)
        ranking = np.concatenate((ranking, ranked(children, running)), axis=1)
        survivors, ranking = select(everyone, ranking, settings.survivors)
        improved[running[ranking[:, 0] < before]] = generation
        evaluations += children.shape[1]
        record()
        to_come = len(running) * (1 - generation / settings.max_generations)
        progress(1 - to_come / len(rngs))
    fits = []
    for course in courses:
        (parameters, misfit, _, evaluations), generations = course[-1], len(course) - 1
        why = "stalled" if generations < settings.max_generations else "generation limit"
        given = parameters, misfit, generations, evaluations, why
        fits.append(Fit(*given, History.of(course)))
    return fits


def select(chromosomes: Chromosomes, ranking: Ranking, count: int) -> tuple[Chromosomes, Ranking]:
    """Select the best individuals of each population by their misfits, best first.

    Parameters
    ----------
    chromosomes, ranking
        Individuals, (n_populations, n, n_genes), and their misfits, (n_populations, n).
    count
        Number of survivors.

    Returns
    -------
    tuple
        Both of the survivors. NaN is ranked last; of equals the one with the lowest genes is first.
    """
    keys: list[NDArray[Any]] = [*np.moveaxis(chromosomes, -1, 0)[::-1], ranking]
    order = np.lexsort(keys)[:, :count]
    return _taken(chromosomes, order), _taken(ranking, order)


def _taken(individuals: NDArray[Any], which: IntArray) -> NDArray[Any]:
    """Return individuals of each population by their indices, (n_populations, n_taken)."""
    populations, count = individuals.shape[:2]
    flat = which + count * np.arange(populations)[:, None]
    return individuals.reshape(populations * count, *individuals.shape[2:]).take(flat, axis=0)


def cross(
    parents: Chromosomes,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> Chromosomes:
    """Produce both children of pairs of parents, (n_populations, n, n_genes), best first."""
    populations, count, genes = parents.shape
    n_children = settings.population - settings.survivors
    pairs = -(-n_children // 2)
    mates = np.empty((populations, pairs, 2), dtype=np.int64)
    head = np.empty((populations, pairs, genes), dtype=bool)
    for row, rng in enumerate(rngs):
        mates[row] = _mates(count, pairs, settings, rng)
        head[row] = np.arange(genes) < _cuts(pairs, genome, settings, rng)
    mothers, fathers = (_taken(parents, mates[:, :, parent]) for parent in (0, 1))
    children = np.where(head, mothers, fathers), np.where(head, fathers, mothers)
    return np.concatenate(children, axis=1)[:, :n_children]


def _mates(
    parents: int, pairs: int, settings: GeneticSettings, rng: np.random.Generator
) -> IntArray:
    """Draw the indices of mothers and fathers, (pairs, 2)."""
    if settings.mating == "rank":
        rank = np.arange(parents, 0, -1)
        return rng.choice(parents, size=(pairs, 2), p=rank / rank.sum())
    even = parents // 2 * 2
    rounds = [rng.permutation(parents)[:even] for _ in range(-(-2 * pairs // even))]
    return np.concatenate(rounds)[: 2 * pairs].reshape(pairs, 2)


def _cuts(
    pairs: int, genome: Genome, settings: GeneticSettings, rng: np.random.Generator
) -> IntArray:
    """Draw where genes of the first parent end, (pairs, 1), or in each parameter, (pairs, n)."""
    ends = np.cumsum(genome.sizes)
    if settings.cut == "each":
        within = rng.integers(0, genome.sizes, size=(pairs, len(ends)), endpoint=True)
        return np.repeat(ends - genome.sizes + within, genome.sizes, axis=1)
    if settings.cut == "between" and len(ends) > 1:
        return rng.choice(ends[:-1], size=(pairs, 1))
    last = len(genome.low) - 1
    return rng.integers(min(1, last), last, size=(pairs, 1), endpoint=True)


def mutate(
    chromosomes: Chromosomes,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> None:
    """Mutate individuals, (n_populations, n, n_genes), in place: redraw genes of some of them."""
    for population, rng in zip(chromosomes, rngs, strict=True):
        mutating = np.flatnonzero(rng.random(len(population)) < settings.mutation_probability)
        for _ in range(settings.mutated_genes):
            gene = rng.integers(len(genome.low), size=len(mutating))
            low, high = genome.low[gene], genome.high[gene]
            population[mutating, gene] = rng.integers(low, high, endpoint=True)
