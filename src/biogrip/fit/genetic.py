"""Settings of the paper's genetic algorithm.

Random draws of mutation: genes, and a new value of each between its own bounds.

The numbers are those of numpy's `Generator.integers` with bounds for each, by Lemire's method
from 32-bit words, in a fraction of its time for many generators.

Truncation selection: the best individuals of populations, in a reproducible order.

Crossover and mutation of populations side by side, each with a generator of its own.

The random numbers of a population do not depend on the other populations.

The paper's genetic algorithm (section 4), with a setting for each detail left open there.

References
----------
.. [1] D. Lemire, Fast random integer generation in an interval, ACM Transactions on Modeling
   and Computer Simulation 29 (2019), article 3.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from biogrip.arrays import Array, IntArray
from biogrip.digits import counted
from biogrip.fit.genome import WORD_BITS, Genome
from biogrip.fit.problem import History, Identification, Problem, Progress, silent
from biogrip.keys import Block
from biogrip.keys import Problem as Complaint
from biogrip.physics.misfit import Misfits, combine_misfits

_MOST = 1_000_000


@dataclass(frozen=True)
class GeneticSettings(Block):
    """Settings of the genetic algorithm (section 4)."""

    population: Annotated[int, Field(ge=4, le=_MOST)]
    """Individuals in a generation."""
    survivors: Annotated[int, Field(ge=2, le=_MOST)]
    """Number of the best, which survive unchanged and are the parents of the others."""
    mating: Literal["pairs", "rank"]
    """`pairs`: survivors form random disjoint pairs; `rank`: parents are drawn with a probability
    proportional to their rank."""
    first_cut: Annotated[int, Field(ge=1, le=50)]
    """Smallest number of genes that a child takes from its first parent."""
    last_cut: Annotated[int, Field(ge=-50, le=50)]
    """Largest number of genes that a child takes from its first parent. Negative numbers count from
    the end; -1 is one less than the chromosome has, 11 with twelve genes."""
    mutation_start: Annotated[int, Field(ge=1, le=_MOST)]
    """First generation whose children mutate."""
    mutation_probability: Annotated[float, Field(ge=0, le=1)]
    """Share of the children that mutate."""
    mutated_genes: Annotated[int, Field(ge=1, le=50)]
    """Number of times that a gene of such a child is chosen and redrawn from its range."""
    patience: Annotated[int, Field(ge=1, le=_MOST)]
    """Stop after this number of generations without improvement of the best misfit."""
    min_generations: Annotated[int, Field(ge=0, le=_MOST)]
    """Fewest generations."""
    max_generations: Annotated[int, Field(ge=1, le=_MOST)]
    """Most generations."""
    mutants: Literal["children", "all"] = "children"
    """Individuals that may mutate: `children`; or `all`, survivors except the best, too."""

    def problems(self) -> Iterator[Complaint]:
        """Find settings that leave no children, or whose limits of generations conflict."""
        if self.survivors >= self.population:
            text = f"found {self.survivors}, allowed is less than population"
            yield ("survivors",), f"{text}, which is {self.population}."
        if self.min_generations > self.max_generations:
            text = f"found {self.min_generations}, allowed is at most max_generations"
            yield ("min_generations",), f"{text}, which is {self.max_generations}."

    def problems_of(self, genes: int) -> Iterator[Complaint]:
        """Find crossover cuts that a chromosome of `genes` genes cannot have."""
        last = self.last_cut if self.last_cut > 0 else genes + self.last_cut
        if genes and not 1 <= self.first_cut <= last:
            text = f"found {self.first_cut}, allowed is 1 to last_cut, "
            yield ("first_cut",), f"{text}which is {last} of {counted(genes, 'gene')} here."


_WORDS = 2**32
_WIDEST = 2**31


def redraws(
    genome: Genome, counts: Sequence[int], times: int, rngs: Sequence[np.random.Generator]
) -> IntArray:
    """Draw, a number of times, a random gene of each chromosome and its new value.

    Parameters
    ----------
    genome
        Encoding of the parameters.
    counts
        Number of chromosomes of each generator.
    times
        Number of draws for each chromosome.
    rngs
        Random generators.

    Returns
    -------
    (times, 2, n)
        Genes and their values, the chromosomes of all generators side by side.
    """
    # A gene of one value takes no random word, and products must not overflow.
    if len(rngs) > 1 and genome.values.min() > 1 and genome.values.max() < _WIDEST:
        before = [rng.bit_generator.state for rng in rngs]
        drawn, doubtful = _side_by_side(genome, counts, times, rngs)
        if not doubtful:
            return drawn
        for rng, state in zip(rngs, before, strict=True):
            rng.bit_generator.state = state
    apart = [_by_numpy(genome, count, times, rng) for count, rng in zip(counts, rngs, strict=True)]
    return np.concatenate(apart, axis=2)


def _side_by_side(
    genome: Genome, counts: Sequence[int], times: int, rngs: Sequence[np.random.Generator]
) -> tuple[IntArray, bool]:
    """Draw as `redraws` does; return also True if numpy might have rejected a word."""
    words = [
        rng.integers(_WORDS, size=2 * times * count, dtype=np.uint32).reshape(times, 2, count)
        for count, rng in zip(counts, rngs, strict=True)
    ]
    joined = np.concatenate(words, axis=2)
    drawn, doubtful = np.empty(joined.shape, dtype=np.int64), False
    for (of_gene, of_value), (gene, value) in zip(joined, drawn, strict=True):
        doubtful |= _scaled(of_gene, genome.genes, gene)
        doubtful |= _scaled(of_value, genome.values.take(gene), value)
        value += genome.low.take(gene)
    return drawn, doubtful


def _by_numpy(genome: Genome, count: int, times: int, rng: np.random.Generator) -> IntArray:
    drawn = np.empty((times, 2, count), dtype=np.int64)
    for gene, value in drawn:
        gene[:] = rng.integers(genome.genes, size=count)
        value[:] = rng.integers(genome.low.take(gene), genome.high.take(gene), endpoint=True)
    return drawn


def _scaled(words: NDArray[np.uint32], spans: IntArray | int, numbers: IntArray) -> bool:
    """Scale words to numbers below the spans; return True if numpy might reject a word."""
    products = words.astype(np.int64)
    products *= spans
    np.right_shift(products, 32, out=numbers)
    products &= _WORDS - 1
    return bool((products < spans).any())


Ranking = NDArray[np.float32]

# Bits that a sorted 64-bit integer has left beside a word of a code and its sign.
_PLACE_BITS = 63 - WORD_BITS


def best(codes: IntArray, ranking: Ranking, count: int) -> tuple[IntArray, Ranking]:
    """Select the best individuals of each population, best first, ties in the order of codes.

    Parameters
    ----------
    codes : (n_words, n_populations, n)
        Chromosomes, see `Genome.code`.
    ranking : (n_populations, n)
        Their misfits, not negative; NaN is ranked last.
    count
        Number of individuals to select.

    Returns
    -------
    codes : (n_words, n_populations, count)
    ranking : (n_populations, count)
    """
    words, populations, size = codes.shape
    first = size * np.arange(populations)[:, None]
    if words > 1 or size > 2**_PLACE_BITS:
        order = first + np.lexsort((*codes[::-1], ranking))[:, :count]
        return codes.reshape(words, -1).take(order, axis=1), ranking.take(order)
    # Sorting integers is several times as fast as sorting indices: first the codes, each with
    # its place; then the misfits, which order like their bits, each with its code's rank.
    bits = (size - 1).bit_length()
    places = codes[0] << bits
    places |= np.arange(size)
    places.sort()
    coded = places >> bits
    places &= (1 << bits) - 1
    places += first
    ranks = ranking.view(np.int32).take(places).astype(np.int64)
    ranks <<= bits
    ranks |= np.arange(size)
    ranks.sort()
    ranks = ranks[:, :count]
    kept = (ranks >> bits).astype(np.int32).view(np.float32)
    return coded.take((ranks & ((1 << bits) - 1)) + first)[None], kept


def cross(
    parents: IntArray,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> IntArray:
    """Produce children by single-point crossover; both children of a pair are kept.

    Parameters
    ----------
    parents : (n_words, n_populations, n_parents)
        Codes, best first.
    genome, settings
        Encoding of the parameters, and settings of mating and mutation.
    rngs
        A generator for each population.

    Returns
    -------
    (n_words, n_populations, n_children)
    """
    words, populations, count = parents.shape
    n_children = settings.population - settings.survivors
    pairs = -(-n_children // 2)
    first, last = (
        min(cut if cut > 0 else genome.genes + cut, genome.genes - 1)
        for cut in (settings.first_cut, settings.last_cut)
    )
    drawn = np.empty((populations, pairs, 2), dtype=np.int64)
    cut = np.empty((populations, pairs), dtype=np.int64)
    for mates, cuts, rng in zip(drawn, cut, rngs, strict=True):
        mates[:] = _mates(count, pairs, settings, rng)
        cuts[:] = rng.integers(min(first, last), last, size=pairs, endpoint=True)
    drawn += count * np.arange(populations)[:, None, None]
    mated = parents.reshape(words, -1).take(drawn.swapaxes(1, 2), axis=1)
    children = genome.crossed(mated, cut).reshape(words, populations, -1)
    return np.ascontiguousarray(children[:, :, :n_children])


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


def mutate(
    children: IntArray,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> None:
    """Mutate children in place: redraw random genes of a random share of them.

    Parameters
    ----------
    children : (n_words, n_populations, n_children)
        Codes.
    genome, settings, rngs
        As in `cross`.
    """
    chance = np.empty(children.shape[1:])
    for own, rng in zip(chance, rngs, strict=True):
        rng.random(out=own)
    mutating = np.flatnonzero(chance < settings.mutation_probability)
    counts = np.bincount(mutating // children.shape[2], minlength=len(rngs)).tolist()
    flat = children.reshape(len(children), -1)
    for gene, value in redraws(genome, counts, settings.mutated_genes, rngs):
        genome.redraw(flat, mutating, gene, value)


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
