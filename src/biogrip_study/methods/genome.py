"""The chromosome: exponent and digits of each parameter are genes (eq. 10, Tables 3, 4)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray
from biogrip.fit.problem import GeneRange

Chromosomes = NDArray[np.integer[Any]]
"""Genes of individuals, (..., n_genes)."""


@dataclass(frozen=True)
class Genome:
    """Encoding of a sample model's parameters as genes."""

    low: IntArray
    """Smallest value of each gene, included, (n_genes,)."""
    high: IntArray
    """Largest one, included, (n_genes,)."""
    sizes: tuple[int, ...]
    """Number of genes of each parameter, (n_parameters,): its exponent and digits, in this order,
    or its bits."""
    binary: tuple[tuple[int, GeneRange], ...] = ()
    """Index and range of each parameter that has bits."""

    @property
    def genes(self) -> int:
        """Length of a chromosome."""
        return len(self.low)

    def draw(self, count: int, rng: np.random.Generator) -> IntArray:
        """Draw chromosomes uniformly, shape (count, n_genes)."""
        return rng.integers(self.low, self.high, size=(count, self.genes), endpoint=True)

    def decode(self, chromosomes: Chromosomes) -> Array:
        """Decode chromosomes into parameters, 10^g_1 (0.1 g_2 + 0.01 g_3 + ...) (eq. 10).

        Of (..., n_genes) they are (..., n_parameters). Each is the double nearest to the encoded
        decimal number: the digits form an integer, and powers of ten up to 10^22 are exact, so that
        only one operation rounds.
        """
        digits = np.array(self.sizes) - 1
        powers = chromosomes[..., self._exponents] - digits + _LARGEST_POWER
        parameters: Array = chromosomes @ self._places
        parameters *= _TIMES_POWER.take(powers)
        parameters /= _OVER_POWER.take(powers)
        for parameter, genes in self.binary:
            first = self._exponents[parameter]
            bits = chromosomes[..., first : first + genes.bits]
            parameters[..., parameter] = _of_bits(genes, bits)
        return parameters

    def keys(self, chromosomes: Chromosomes) -> list[Array]:
        """Return numbers that order chromosomes, (..., n_genes), by their first unequal gene.

        The number of the last genes comes first, as for `numpy.lexsort`. There are several where
        one, a double, would not be exact.
        """
        numbers = (chromosomes - self.low.astype(chromosomes.dtype)) @ self._weights
        return [numbers[..., column] for column in range(numbers.shape[-1])]

    @cached_property
    def _exponents(self) -> IntArray:
        """Index of the exponent of each parameter."""
        return np.cumsum((0, *self.sizes[:-1]))

    @cached_property
    def _places(self) -> Array:
        """Place value of each digit in the integer of its parameter, (n_genes, n_parameters)."""
        places = np.zeros((self.genes, len(self.sizes)))
        for parameter, (exponent, size) in enumerate(zip(self._exponents, self.sizes, strict=True)):
            places[exponent + 1 : exponent + size, parameter] = 10.0 ** np.arange(size - 2, -1, -1)
        return places

    @cached_property
    def _weights(self) -> Array:
        """Place value of each gene in the numbers of `keys`, (n_genes, n_numbers)."""
        columns, weight = [np.zeros(self.genes)], 1
        for gene in range(self.genes)[::-1]:
            values = int(self.high[gene] - self.low[gene]) + 1
            if weight * values > 2**53:
                columns, weight = [*columns, np.zeros(self.genes)], 1
            columns[-1][gene] = weight
            weight *= values
        return np.stack(columns, axis=1)


# The largest power of ten that is an exact double.
_LARGEST_POWER = 22
_POWERS = range(-_LARGEST_POWER, _LARGEST_POWER + 1)
_TIMES_POWER = np.array([10.0 ** max(power, 0) for power in _POWERS])
_OVER_POWER = np.array([10.0 ** max(-power, 0) for power in _POWERS])


def make_genome(ranges: Sequence[GeneRange]) -> Genome:
    """Return the genome of parameters, from the gene range of each."""
    low, high = (np.concatenate(ends) for ends in zip(*(g.bounds for g in ranges), strict=True))
    sizes = tuple(len(genes.bounds[0]) for genes in ranges)
    return Genome(low, high, sizes, tuple((i, g) for i, g in enumerate(ranges) if g.bits))


@cache
def encodable_values(genes: GeneRange) -> Array:
    """Return all positive values that genes can encode, ascending, each the nearest double."""
    if genes.bits:
        return np.geomspace(genes.low, genes.high, 2**genes.bits)
    mantissas = np.zeros(1)
    for least, most in zip(genes.least[1:], genes.most[1:], strict=True):
        mantissas = (10 * mantissas[:, None] + np.arange(least, most + 1)).ravel()
    powers = np.arange(genes.exponent[0], genes.exponent[1] + 1) - genes.digits + _LARGEST_POWER
    values: Array = mantissas * _TIMES_POWER[powers, None] / _OVER_POWER[powers, None]
    return np.unique(values[values > 0]) if genes.least[1] == 0 else values.ravel()


def _of_bits(genes: GeneRange, bits: Chromosomes) -> Array:
    """Decode bits, (..., n_bits), the largest first, into a value each."""
    plain = np.bitwise_xor.accumulate(bits, axis=-1) if genes.gray else bits
    return encodable_values(genes)[plain @ (1 << np.arange(genes.bits)[::-1])]


def nearest_encodable(value: float, genes: GeneRange) -> float:
    """Return the number closest to a positive value that the genes can encode."""
    values = encodable_values(genes)
    return float(values[np.argmin(np.abs(values - value))])


# Least relative decrease of the misfit that counts, so that all processors take the same steps.
_LEAST_DECREASE = 1e-7
# Parameters changed at once: with three a search follows a valley.
_CHANGED_AT_ONCE = 3


def lowest_encodable(
    misfit: Callable[[Array], Array], ranges: Sequence[GeneRange], starts: Array
) -> float:
    """Return the lowest misfit of all encodable points around some starts, (n, n_parameters).

    Around each start's nearest encodable point all neighbours are computed, the last digit or the
    one before it up or down by one in up to three parameters, and then around the best of them,
    until none is better. A lower point elsewhere is not excluded.
    """
    values = [encodable_values(genes) for genes in ranges]
    tens = [genes.most[-1] - genes.least[-1] + 1 for genes in ranges]
    every = product(*((-ten, -1, 0, 1, ten) for ten in tens))
    steps = np.array(sorted(every, key=np.count_nonzero))
    steps = steps[np.count_nonzero(steps, axis=1) <= _CHANGED_AT_ONCE]
    columns = zip(values, starts.T, strict=True)
    places = np.stack(
        [abs(encodable - start[:, None]).argmin(axis=1) for encodable, start in columns], axis=1
    )
    lowest = np.inf
    while len(places):
        around = np.unique(places, axis=0)[:, None] + steps
        np.clip(around, 0, [len(encodable) - 1 for encodable in values], out=around)
        columns = zip(values, around.reshape(-1, len(values)).T, strict=True)
        misfits = misfit(np.stack([encodable[at] for encodable, at in columns], axis=1))
        misfits = misfits.reshape(around.shape[:2])
        best = np.arange(len(around)), misfits.argmin(axis=1)
        places = around[best][misfits[best] < (1 - _LEAST_DECREASE) * misfits[:, 0]]
        lowest = min(lowest, float(misfits.min()))
    return lowest
