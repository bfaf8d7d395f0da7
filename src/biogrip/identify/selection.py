"""Truncation selection: the best of populations, in an order that nothing but they decide."""

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import IntArray
from biogrip.identify.genome import WORD_BITS

Ranking = NDArray[np.float32]

# So many bits a sorted number has left beside a word of a code; its sign stays free.
_PLACE_BITS = 63 - WORD_BITS


def best(codes: IntArray, ranking: Ranking, count: int) -> tuple[IntArray, Ranking]:
    """Keep the best of each population, best first, ties in the order of their codes.

    Parameters
    ----------
    codes : (n_words, n_populations, n)
        The chromosomes, see `Genome.code`.
    ranking : (n_populations, n)
        What they are ranked on; not negative, what is not a number last.
    count
        How many to keep.

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
    # Numbers by themselves are sorted several times as fast as indices: first the codes, each
    # with its place; then the rankings, which order like their bits, each with its code's rank.
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
