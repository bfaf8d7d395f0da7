"""The chromosome: exponent and digits of each parameter are genes (eq. 10, Tables 3, 4)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from biogrip.arrays import Array, IntArray
from biogrip.keys import Block, Complaint
from biogrip.physics.sample_model import SampleModel

Chromosomes = NDArray[np.integer[Any]]
"""Genes of individuals, (..., n_genes)."""


@dataclass(frozen=True)
class GeneRange(Block):
    """Values that the genes of one parameter may take (Table 3)."""

    exponent: Annotated[
        tuple[Annotated[int, Field(ge=-16, le=18)], ...], Field(min_length=2, max_length=2)
    ]
    """Lowest and highest order of magnitude g₁ (eq. 10)."""
    digit: Annotated[
        tuple[Annotated[int, Field(ge=0, le=9)], ...], Field(min_length=2, max_length=2)
    ]
    """Lowest and highest value of the digits g₂, g₃ and so on (eq. 10)."""
    digits: Annotated[int, Field(ge=1, le=6)] = 2
    """Number of digits; in eq. (10) two."""
    first_digit: Annotated[int, Field(ge=0, le=1)] = 1
    """Lowest value of the first digit g₂, if the others' is no higher. With 0 there are smaller
    numbers, and several ways to encode one."""
    bits: Annotated[int, Field(ge=0, le=20)] = 0
    """Number of genes that are bits of the logarithm between the ends of the range, in the place of
    exponent and digits; with 0 there are none."""
    gray: bool = False
    """Neighbouring numbers differ by one bit (Gray's code)."""

    def complaints(self) -> Iterator[Complaint]:
        """Find bounds in the wrong order, and a range of a single value."""
        for gene, (low, high) in (("exponent", self.exponent), ("digit", self.digit)):
            if low > high:
                yield (gene,), f"found [{low}, {high}], allowed is [lowest, highest]."
        if self.digit[1] < 1:
            text = f"found {list(self.digit)}, allowed is a highest digit of at least 1."
            yield ("digit",), text
        elif self.least == self.most:
            text = "leaves one value, and nothing to search for; allowed are more. What is known is"
            yield (), f"{text} given under the case's key fixed."

    @property
    def bounds(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Smallest and largest value of each gene."""
        return (self.bits * (0,), self.bits * (1,)) if self.bits else (self.least, self.most)

    @property
    def least(self) -> tuple[int, ...]:
        """Smallest value of exponent and digits."""
        first = max(self.digit[0], self.first_digit)
        return self.exponent[0], first, *[self.digit[0]] * (self.digits - 1)

    @property
    def most(self) -> tuple[int, ...]:
        """Largest value of exponent and digits."""
        return self.exponent[1], *[self.digit[1]] * self.digits

    @property
    def low(self) -> float:
        """Smallest positive value that can be encoded (Table 4)."""
        return _value(self.least) or _value((self.exponent[0], *[0] * (self.digits - 1), 1))

    @property
    def high(self) -> float:
        """Largest value that can be encoded (Table 4)."""
        return _value(self.most)

    @property
    def values(self) -> Array:
        """All positive values that can be encoded, ascending, each the nearest double."""
        if self.bits:
            return self._between(np.arange(2**self.bits))
        mantissas = np.zeros(1)
        for least, most in zip(self.least[1:], self.most[1:], strict=True):
            mantissas = (10 * mantissas[:, None] + np.arange(least, most + 1)).ravel()
        powers = np.arange(self.exponent[0], self.exponent[1] + 1) - self.digits + _LARGEST_POWER
        values: Array = mantissas * _TIMES[powers, None] / _OVER[powers, None]
        if self.least[1] == 0:
            return np.unique(values[values > 0])
        return values.ravel()

    def of_bits(self, bits: Chromosomes) -> Array:
        """Decode bits, (..., n_bits), the largest first, into a value each."""
        plain = np.bitwise_xor.accumulate(bits, axis=-1) if self.gray else bits
        return self._between(plain @ (1 << np.arange(self.bits)[::-1]))

    def _between(self, numbers: IntArray) -> Array:
        low, high = np.log([self.low, self.high])
        values: Array = np.exp(low + (high - low) * numbers / (2**self.bits - 1))
        return values


@dataclass(frozen=True)
class SearchRange(Block):
    """Search range of each parameter as allowed values of its genes (Tables 3 and 4)."""

    k: GeneRange
    k_p: GeneRange
    c: GeneRange
    c_p: GeneRange
    alpha: GeneRange

    def complaints(self) -> Iterator[Complaint]:
        """Refuse a range that has exponents of springpots above 1."""
        highest = self.alpha.exponent[1]
        if highest > 0:
            text = f"found {highest}, which makes exponents of springpots above 1; allowed is at "
            yield ("alpha", "exponent"), f"{text}most 0."


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
        parameters *= _TIMES.take(powers)
        parameters /= _OVER.take(powers)
        for parameter, genes in self.binary:
            first = self._exponents[parameter]
            bits = chromosomes[..., first : first + genes.bits]
            parameters[..., parameter] = genes.of_bits(bits)
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
_TIMES = np.array([10.0 ** max(power, 0) for power in _POWERS])
_OVER = np.array([10.0 ** max(-power, 0) for power in _POWERS])


def make_genome(model: SampleModel, ranges: Mapping[str, GeneRange]) -> Genome:
    """Return the genome of a sample model, from gene ranges by `Parameter.range_name`."""
    chosen = [ranges[parameter.range_name] for parameter in model.parameters]
    low, high = (np.concatenate(ends) for ends in zip(*(g.bounds for g in chosen), strict=True))
    sizes = tuple(len(genes.bounds[0]) for genes in chosen)
    return Genome(low, high, sizes, tuple((i, g) for i, g in enumerate(chosen) if g.bits))


def nearest_encodable(value: float, genes: GeneRange) -> float:
    """Return the number closest to a positive value that the genes can encode."""
    values = genes.values
    return float(values[np.argmin(np.abs(values - value))])


def _value(genes: tuple[int, ...]) -> float:
    digits = "".join(map(str, genes[1:]))
    return float(f"{digits}e{genes[0] - len(digits)}")


# Least relative decrease of the misfit that counts, so that all processors take the same steps.
_LEAST = 1e-7
# Parameters changed at once: with three a search follows a valley.
_AT_ONCE = 3


def lowest_encodable(
    misfit: Callable[[Array], Array], ranges: Sequence[GeneRange], starts: Array
) -> float:
    """Return the lowest misfit of all encodable points around some starts, (n, n_parameters).

    Around each start's nearest encodable point all neighbours are computed, the last digit or the
    one before it up or down by one in up to three parameters, and then around the best of them,
    until none is better. A lower point elsewhere is not excluded.
    """
    values = [genes.values for genes in ranges]
    tens = [genes.most[-1] - genes.least[-1] + 1 for genes in ranges]
    every = product(*((-ten, -1, 0, 1, ten) for ten in tens))
    steps = np.array(sorted(every, key=np.count_nonzero))
    steps = steps[np.count_nonzero(steps, axis=1) <= _AT_ONCE]
    columns = zip(values, starts.T, strict=True)
    places = np.stack([abs(own - start[:, None]).argmin(axis=1) for own, start in columns], axis=1)
    lowest = np.inf
    while len(places):
        around = np.unique(places, axis=0)[:, None] + steps
        np.clip(around, 0, [len(own) - 1 for own in values], out=around)
        columns = zip(values, around.reshape(-1, len(values)).T, strict=True)
        found = misfit(np.stack([own[at] for own, at in columns], axis=1))
        found = found.reshape(around.shape[:2])
        best = np.arange(len(around)), found.argmin(axis=1)
        places = around[best][found[best] < (1 - _LEAST) * found[:, 0]]
        lowest = min(lowest, float(found.min()))
    return lowest
