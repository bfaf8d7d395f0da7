"""The chromosome: exponent and digits of each parameter are genes (eq. 10, Tables 3, 4)."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate, pairwise
from math import prod
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array, IntArray
from biogrip.keys import Block, Problem
from biogrip.physics.sample_model import SampleModel


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
    """Lowest and highest value of the digits g₂, g₃ and so on (eq. 10). The first is never below 1,
    for numbers with leading zeros would be encoded twice."""
    digits: Annotated[int, Field(ge=1, le=6)] = 2
    """Number of digits; in eq. (10) two."""

    def problems(self) -> Iterator[Problem]:
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
    def least(self) -> tuple[int, ...]:
        """Smallest value of each gene."""
        return self.exponent[0], max(self.digit[0], 1), *[self.digit[0]] * (self.digits - 1)

    @property
    def most(self) -> tuple[int, ...]:
        """Largest value of each gene."""
        return self.exponent[1], *[self.digit[1]] * self.digits

    @property
    def low(self) -> float:
        """Smallest value that can be encoded (Table 4)."""
        return _value(self.least)

    @property
    def high(self) -> float:
        """Largest value that can be encoded (Table 4)."""
        return _value(self.most)


@dataclass(frozen=True)
class SearchRange(Block):
    """Search range of each parameter as allowed values of its genes (Tables 3 and 4)."""

    k: GeneRange
    k_p: GeneRange
    c: GeneRange
    c_p: GeneRange
    alpha: GeneRange

    def problems(self) -> Iterator[Problem]:
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
    """Number of genes of each parameter, (n_parameters,): its exponent and digits, in this
    order."""

    @property
    def genes(self) -> int:
        """Length of a chromosome."""
        return len(self.low)

    def draw(self, count: int, rng: np.random.Generator) -> IntArray:
        """Draw chromosomes uniformly, shape (count, n_genes)."""
        return rng.integers(self.low, self.high, size=(count, self.genes), endpoint=True)

    def decode(self, chromosomes: IntArray) -> Array:
        """Decode chromosomes into parameters, 10^g_1 (0.1 g_2 + 0.01 g_3 + ...) (eq. 10).

        Parameters
        ----------
        chromosomes : (n, n_genes)

        Returns
        -------
        (n, n_parameters)
            Each is the double nearest to the encoded decimal number.
        """
        return self.parameters(self.code(chromosomes))

    def code(self, chromosomes: IntArray) -> IntArray:
        """Encode chromosomes as integers, one or several words each, that sort like their genes.

        A word is a mixed-radix number whose digits are genes, counted from their smallest
        values. So crossover and mutation are arithmetic on codes.

        Parameters
        ----------
        chromosomes : (n, n_genes)

        Returns
        -------
        (n_words, n)
        """
        shifted = chromosomes - self.low
        codes = np.zeros((self._words, len(chromosomes)), dtype=np.int64)
        for gene, (word, weight) in enumerate(zip(self._word, self._weight, strict=True)):
            codes[word] += shifted[:, gene] * weight
        return codes

    def parameters(self, codes: IntArray) -> Array:
        """Decode the codes of chromosomes into parameters, as `decode` does with chromosomes.

        Parameters
        ----------
        codes : (n_words, ...)

        Returns
        -------
        (..., n_parameters)
        """
        parameters = np.empty((len(self.sizes), *codes.shape[1:]))
        rest = codes
        for parameter, (own, values) in enumerate(zip(self._own, self._values_of, strict=True)):
            word, weight = self._word[own.start], int(self._weight[own.stop - 1])
            if parameter == 0 or word != self._word[own.start - 1]:
                rest = codes[word]
            which = rest // weight if weight > 1 else rest
            if weight > 1:
                rest = rest - which * weight
            values(which, parameters[parameter])
        return np.moveaxis(parameters, 0, -1)

    def crossed(self, parents: IntArray, cut: IntArray) -> IntArray:
        """Return both children of each pair, with all genes from the cut on swapped.

        Parameters
        ----------
        parents : (n_words, ..., 2, n_pairs)
            Codes of mothers and fathers.
        cut : (..., n_pairs)
            Number of genes before the cut.

        Returns
        -------
        Codes like the parents', the children that begin like their mothers first.
        """
        tails = parents % self._modulus.take(cut, axis=1)[..., None, :]
        children: IntArray = parents - tails
        children += tails[..., ::-1, :]
        return children

    def redraw(self, codes: IntArray, which: IntArray, gene: IntArray, value: IntArray) -> None:
        """Set one gene of each of some chromosomes to a new value, in place.

        Parameters
        ----------
        codes : (n_words, n)
        which, gene, value : (n_redrawn,)
            Index of the chromosome, none twice; index of its gene; the gene's new value.
        """
        weight = self._weight.take(gene)
        if self._words > 1:
            which = which + codes.shape[1] * self._word.take(gene)
        before = codes.take(which)
        change = value - self.low.take(gene)
        change -= before // weight % self.values.take(gene)
        change *= weight
        change += before
        codes.put(which, change)

    @cached_property
    def values(self) -> IntArray:
        """Number of values of each gene, (n_genes,)."""
        return self.high - self.low + 1

    @cached_property
    def _word(self) -> IntArray:
        """Index of the word that contains each gene; the genes of a parameter share one."""
        words, filled = [0], 1
        for own in self._own:
            values = prod(self.values[own].tolist())
            filled *= values
            if filled > 2**WORD_BITS:
                words.append(words[-1] + 1)
                filled = values
            else:
                words.append(words[-1])
        return np.repeat(words[1:], self.sizes)

    @cached_property
    def _own(self) -> list[slice]:
        """Slices of the chromosome with the genes of each parameter."""
        return [slice(*ends) for ends in pairwise(accumulate(self.sizes, initial=0))]

    @cached_property
    def _words(self) -> int:
        return int(self._word[-1]) + 1

    @cached_property
    def _weight(self) -> IntArray:
        """Place value of each gene in its word."""
        weights = np.ones(self.genes, dtype=np.int64)
        for gene in range(self.genes - 2, -1, -1):
            if self._word[gene] == self._word[gene + 1]:
                weights[gene] = weights[gene + 1] * self.values[gene + 1]
        return weights

    @cached_property
    def _modulus(self) -> IntArray:
        """Moduli that reduce a word to its genes from each cut on, (n_words, n_genes)."""
        moduli = np.empty((self._words, self.genes), dtype=np.int64)
        for word in range(self._words):
            own = np.flatnonzero(self._word == word)
            every = self._weight[own[0]] * self.values[own[0]]
            moduli[word] = np.where(np.arange(self.genes) < own[0], every, 1)
            moduli[word, own] = self._weight[own] * self.values[own]
        return moduli

    @cached_property
    def _values_of(self) -> list["_Values"]:
        """Functions from the number that a parameter's genes form to the parameter's value."""
        ends = [(self.low[own].tolist(), self.high[own].tolist()) for own in self._own]
        return [_values(tuple(low), tuple(high)) for low, high in ends]


_Values = Callable[[IntArray, Array], None]
"""Function that writes the parameter values of given numbers to an array of their shape."""


@lru_cache(maxsize=64)
def _values(low: tuple[int, ...], high: tuple[int, ...]) -> _Values:
    """Return a function from the number that a parameter's genes form to its value."""
    exponents, mantissas = np.arange(low[0], high[0] + 1), _mantissas(low[1:], high[1:])
    # Both powers are exact doubles, and one of them is 1, so this rounds once.
    power = exponents + (_LARGEST_POWER - len(low) + 1)
    multiplier, divisor = _MULTIPLIER[power], _DIVISOR[power]
    if len(exponents) * len(mantissas) <= _LARGEST_TABLE:
        table = (mantissas * multiplier[:, None] / divisor[:, None]).ravel()

        def look_up(which: IntArray, out: Array) -> None:
            table.take(which, out=out, mode="clip")

        return look_up

    def computed(which: IntArray, out: Array) -> None:
        exponent = which // len(mantissas)
        mantissas.take(which - exponent * len(mantissas), out=out, mode="clip")
        out *= multiplier.take(exponent)
        out /= divisor.take(exponent)

    return computed


@lru_cache(maxsize=64)
def _mantissas(low: tuple[int, ...], high: tuple[int, ...]) -> Array:
    """Return all allowed sequences of digits as integers, ascending."""
    numbers = np.zeros(1)
    for least, most in zip(low, high, strict=True):
        numbers = (10 * numbers[:, None] + np.arange(least, most + 1)).ravel()
    return numbers


# Largest table of all values of a parameter; with six digits it would take 100 MB.
_LARGEST_TABLE = 2**17

WORD_BITS = 48
"""Number of bits in a word of a code."""

# The largest power of ten that is an exact double.
_LARGEST_POWER = 22
_POWERS = range(-_LARGEST_POWER, _LARGEST_POWER + 1)
_MULTIPLIER = np.array([10.0 ** max(power, 0) for power in _POWERS])
_DIVISOR = np.array([10.0 ** max(-power, 0) for power in _POWERS])


def make_genome(model: SampleModel, ranges: Mapping[str, GeneRange]) -> Genome:
    """Return the genome of a sample model.

    Parameters
    ----------
    model
        Gives the order of the parameters.
    ranges
        Gene ranges by the name of the range, see `Parameter.range_name`.
    """
    chosen = [ranges[parameter.range_name] for parameter in model.parameters]
    low = np.concatenate([genes.least for genes in chosen])
    high = np.concatenate([genes.most for genes in chosen])
    return Genome(low, high, tuple(genes.digits + 1 for genes in chosen))


def nearest_encodable(value: float, genes: GeneRange) -> float:
    """Return the number closest to a positive value that the genes can encode."""
    mantissas = _mantissas(genes.least[1:], genes.most[1:])
    found = []
    for exponent in range(genes.exponent[0], genes.exponent[1] + 1):
        scaled = value / 10.0 ** (exponent - genes.digits)
        nearest = mantissas[np.argmin(np.abs(mantissas - scaled))]
        found.append(float(f"{nearest:.0f}e{exponent - genes.digits}"))
    return min(found, key=lambda candidate: abs(candidate - value))


def _value(genes: tuple[int, ...]) -> float:
    digits = "".join(map(str, genes[1:]))
    return float(f"{digits}e{genes[0] - len(digits)}")
