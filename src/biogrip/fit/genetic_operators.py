"""Crossover and mutation of populations side by side, each with a generator of its own.

The random numbers of a population do not depend on the other populations.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import IntArray
from biogrip.fit.genetic_settings import GeneticSettings
from biogrip.fit.genome import Genome
from biogrip.fit.redraws import redraws


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
