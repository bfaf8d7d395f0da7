"""Truncation selection: the best individuals of populations, in a reproducible order."""

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import IntArray
from biogrip.fit.genome import WORD_BITS

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
