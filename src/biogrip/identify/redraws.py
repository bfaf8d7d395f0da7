"""What mutation draws: genes, and a new value of each between its own bounds.

It is what numpy's `Generator.integers` draws one after the other with bounds for each, by
Lemire's method from 32-bit words, at a fraction of the time for many generators.
"""

from collections.abc import Iterator, Sequence
from itertools import chain, repeat

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import IntArray
from biogrip.identify.genome import Genome

_WORDS = 2**32


def redraws(
    genome: Genome, counts: Sequence[int], times: int, rngs: Sequence[np.random.Generator]
) -> IntArray:
    """Draw a gene of each of some chromosomes and its new value, so many times.

    Parameters
    ----------
    genome
        What a chromosome may be.
    counts
        Number of chromosomes of each generator.
    times
        Genes of each.
    rngs
        The generators.

    Returns
    -------
    (times, 2, n)
        Genes and their values, the chromosomes of all generators side by side.
    """
    if np.any(genome.low == genome.high):
        # What cannot vary takes no word.
        return np.concatenate(
            [
                _one_by_one(genome, count, times, _fresh(rng))
                for count, rng in zip(counts, rngs, strict=True)
            ],
            axis=2,
        )
    words = [
        rng.integers(_WORDS, size=2 * times * count, dtype=np.uint32).reshape(times, 2, count)
        for count, rng in zip(counts, rngs, strict=True)
    ]
    together = np.concatenate(words, axis=2)
    drawn = np.empty(together.shape, dtype=np.int64)
    spans = (genome.high - genome.low + 1).astype(np.uint64)
    doubtful = False
    for (of_gene, of_value), (gene, value) in zip(together, drawn, strict=True):
        doubtful |= _scaled(of_gene, np.uint64(genome.genes), gene)
        doubtful |= _scaled(of_value, spans.take(gene), value)
        value += genome.low.take(gene)
    if not doubtful:
        return drawn
    return np.concatenate(
        [
            _one_by_one(genome, own.shape[2], times, chain(own.ravel().tolist(), _fresh(rng)))
            for own, rng in zip(words, rngs, strict=True)
        ],
        axis=2,
    )


def _scaled(
    words: NDArray[np.uint32], spans: NDArray[np.uint64] | np.uint64, numbers: IntArray
) -> bool:
    """Scale words to numbers below the spans; whether any may have to be drawn again."""
    products = words * spans
    numbers[:] = products >> np.uint64(32)
    return bool(np.any(products.astype(np.uint32) < spans))


def _fresh(rng: np.random.Generator) -> Iterator[int]:
    return (int(rng.integers(_WORDS, dtype=np.uint32)) for _ in repeat(None))


def _one_by_one(genome: Genome, count: int, times: int, words: Iterator[int]) -> IntArray:
    """Draw for one generator from its words, those again that would favour some numbers."""
    low, high = genome.low.tolist(), genome.high.tolist()

    def below(span: int) -> int:
        while span > 1:
            product = next(words) * span
            if product % _WORDS >= _WORDS % span:
                return product // _WORDS
        return 0

    drawn = []
    for _ in range(times):
        genes = [below(genome.genes) for _ in range(count)]
        drawn.append((genes, [low[gene] + below(high[gene] - low[gene] + 1) for gene in genes]))
    return np.array(drawn, dtype=np.int64).reshape(times, 2, count)
