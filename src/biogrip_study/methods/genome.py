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

    ranges: tuple[GeneRange, ...]
    """Of each parameter, (n_parameters,): its genes are exponent and digits, in this order, or
    bits."""

    @cached_property
    def low(self) -> IntArray:
        """Smallest value of each gene, included, (n_genes,)."""
        return np.concatenate([genes.bounds[0] for genes in self.ranges])

    @cached_property
    def high(self) -> IntArray:
        """Largest one, included, (n_genes,)."""
        return np.concatenate([genes.bounds[1] for genes in self.ranges])

    @cached_property
    def sizes(self) -> IntArray:
        """Number of genes of each parameter, (n_parameters,)."""
        return np.array([len(genes.bounds[0]) for genes in self.ranges])

    def draw(self, count: int, rng: np.random.Generator) -> IntArray:
        """Draw chromosomes uniformly, shape (count, n_genes)."""
        return rng.integers(self.low, self.high, size=(count, len(self.low)), endpoint=True)

    def decode(self, chromosomes: Chromosomes) -> Array:
        """Decode chromosomes, (..., n_genes), into parameters, (..., n_parameters)."""
        parts = np.split(chromosomes, np.cumsum(self.sizes)[:-1], axis=-1)
        pairs = zip(self.ranges, parts, strict=True)
        return np.stack([_decoded(genes, part) for genes, part in pairs], axis=-1)


# The largest power of ten that is an exact double.
_LARGEST_POWER = 22
_POWERS = range(-_LARGEST_POWER, _LARGEST_POWER + 1)
_TIMES_POWER = np.array([10.0 ** max(power, 0) for power in _POWERS])
_OVER_POWER = np.array([10.0 ** max(-power, 0) for power in _POWERS])


def _decoded(genes: GeneRange, part: Chromosomes) -> Array:
    """Decode genes of one parameter, (..., n_genes): 10^g_1 (0.1 g_2 + 0.01 g_3 + ...) (eq. 10).

    It is the double nearest to the encoded decimal number: the digits form an integer, and powers
    of ten up to 10^22 are exact, so that only one operation rounds. Of bits the largest is first.
    """
    if genes.bits:
        bits = np.bitwise_xor.accumulate(part, axis=-1) if genes.gray else part
        return encodable_values(genes)[bits @ (1 << np.arange(genes.bits)[::-1])]
    mantissas = part[..., 1:] @ 10.0 ** np.arange(genes.digits)[::-1]
    powers = part[..., 0] - genes.digits + _LARGEST_POWER
    return np.asarray(mantissas * _TIMES_POWER.take(powers) / _OVER_POWER.take(powers))


@cache
def encodable_values(genes: GeneRange) -> Array:
    """Return all positive values that genes can encode, ascending, each the nearest double."""
    if genes.bits:
        return np.geomspace(genes.low, genes.high, 2**genes.bits)
    every = [np.arange(least, most + 1) for least, most in zip(*genes.bounds, strict=True)]
    chromosomes = np.stack(np.meshgrid(*every, indexing="ij"), axis=-1)
    values = _decoded(genes, chromosomes)
    return np.unique(values[values > 0])


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
    """Return the lowest misfit of all encodable points around some starts.

    Around each start's nearest encodable point all neighbours are computed, the last digit or the
    one before it up or down by one in up to three parameters, and then around the best of them,
    until none is better. A lower point elsewhere is not excluded.

    Parameters
    ----------
    misfit
        Function from parameters in SI units, (n, n_parameters), to misfits, (n,).
    ranges
        Gene range of each parameter.
    starts
        Parameters near which it is looked for, (n_starts, n_parameters).

    Returns
    -------
    float
        In the unit of the misfit.
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
