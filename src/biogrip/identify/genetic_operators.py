"""Crossover and mutation of populations side by side, each with a generator of its own.

What a population draws, and in which order, does not depend on the others.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import IntArray
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.genome import Genome


def cross(
    parents: IntArray,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> IntArray:
    """Single-point crossover; both children of a pair are kept.

    Parameters
    ----------
    parents : (n_words, n_populations, n_parents)
        Codes, best first.
    genome
        What the codes say.
    settings
        How parents are mated.
    rngs
        A generator for each population.

    Returns
    -------
    (n_words, n_populations, n_children)
    """
    words, populations, count = parents.shape
    wanted = settings.population - settings.survivors
    pairs = -(-wanted // 2)
    first, last = (
        min(cut if cut > 0 else genome.genes + cut, genome.genes - 1)
        for cut in (settings.first_cut, settings.last_cut)
    )
    drawn = np.empty((populations, 2 * pairs), dtype=np.int64)
    cut = np.empty((populations, pairs), dtype=np.int64)
    for population, rng in enumerate(rngs):
        drawn[population] = _mates(count, 2 * pairs, settings, rng)
        cut[population] = rng.integers(min(first, last), last, size=pairs, endpoint=True)
    drawn += count * np.arange(populations)[:, None]
    everyone = parents.reshape(words, -1)
    mothers, fathers = (everyone.take(drawn[:, parent::2], axis=1) for parent in (0, 1))
    children = np.concatenate(genome.crossed(mothers, fathers, cut), axis=2)
    return children[:, :, :wanted]


def _mates(
    parents: int, wanted: int, settings: GeneticSettings, rng: np.random.Generator
) -> IntArray:
    """Indices of parents; two that follow one another, the first at an even place, mate."""
    if settings.mating == "rank":
        rank = np.arange(parents, 0, -1)
        return rng.choice(parents, size=(wanted // 2, 2), p=rank / rank.sum()).ravel()
    even = parents // 2 * 2
    rounds = [rng.permutation(parents)[:even] for _ in range(-(-wanted // even))]
    return np.concatenate(rounds)[:wanted]


def mutate(
    children: IntArray,
    genome: Genome,
    settings: GeneticSettings,
    rngs: Sequence[np.random.Generator],
) -> None:
    """Redraw genes of some children in place.

    Parameters
    ----------
    children : (n_words, n_populations, n_children)
        Codes.
    genome
        What the codes say.
    settings
        How many children mutate, and how many genes of each.
    rngs
        A generator for each population.
    """
    chance = np.empty(children.shape[1:])
    for own, rng in zip(chance, rngs, strict=True):
        rng.random(out=own)
    mutating = chance < settings.mutation_probability
    population, child = np.nonzero(mutating)
    counts = np.count_nonzero(mutating, axis=1).tolist()
    redrawn = [
        genome.draw_genes(count, settings.mutated_genes, rng)
        for count, rng in zip(counts, rngs, strict=True)
    ]
    for gene, value in np.concatenate(redrawn, axis=2):
        genome.redraw(children, population, child, gene, value)
