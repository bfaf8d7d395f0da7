"""Random draws of mutation: genes, and a new value of each between its own bounds.

The numbers are those of numpy's `Generator.integers` with bounds for each, by Lemire's method
from 32-bit words, in a fraction of its time for many generators.

References
----------
.. [1] D. Lemire, Fast random integer generation in an interval, ACM Transactions on Modeling
   and Computer Simulation 29 (2019), article 3.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import IntArray
from biogrip.fit.genome import Genome

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
