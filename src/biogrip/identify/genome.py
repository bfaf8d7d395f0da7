"""The chromosome: three integer genes a parameter (eq. 10, Tables 3 and 4)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from typing import Annotated

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.sample import SampleModel
from biogrip.keys import Key, Problem


@dataclass(frozen=True)
class GeneRange:
    """Values that the genes of one parameter may take (Table 3)."""

    exponent: Annotated[
        tuple[Annotated[int, Key(low=-18, high=18)], Annotated[int, Key(low=-18, high=18)]],
        Key("Lowest and highest order of magnitude g₁ (eq. 10)."),
    ]
    digit: Annotated[
        tuple[Annotated[int, Key(low=1, high=9)], Annotated[int, Key(low=1, high=9)]],
        Key("Lowest and highest value of the two digits g₂ and g₃ (eq. 10)."),
    ]

    def problems(self) -> Iterator[Problem]:
        """Find ends in the wrong order, and a range of one value."""
        for gene, (low, high) in vars(self).items():
            if low > high:
                yield (gene,), f"found [{low}, {high}], allowed is [lowest, highest]."
        if all(low == high for low, high in vars(self).values()):
            text = "leaves one value, and nothing to search for; allowed are more. What is known is"
            yield (), f"{text} given under the case's key fixed."

    @property
    def low(self) -> float:
        """Smallest value that can be encoded (Table 4)."""
        return _value(self.exponent[0], self.digit[0], self.digit[0])

    @property
    def high(self) -> float:
        """Largest value that can be encoded (Table 4)."""
        return _value(self.exponent[1], self.digit[1], self.digit[1])


@dataclass(frozen=True)
class Genome:
    """The genes of a sample model.

    Parameters
    ----------
    low, high : (n_genes,)
        Smallest and largest value of each gene, both included; three genes a
        parameter: exponent, first digit, second digit.
    """

    low: IntArray
    high: IntArray

    @property
    def genes(self) -> int:
        """Length of a chromosome."""
        return len(self.low)

    def draw(self, count: int, rng: np.random.Generator) -> IntArray:
        """Draw chromosomes uniformly, shape (count, n_genes)."""
        return rng.integers(self.low, self.high, size=(count, self.genes), endpoint=True)

    def decode(self, chromosomes: IntArray) -> Array:
        """Parameters of chromosomes, 10^g_1 (0.1 g_2 + 0.01 g_3) (eq. 10).

        Parameters
        ----------
        chromosomes : (n, n_genes)

        Returns
        -------
        (n, n_parameters)
            Each the double nearest to the decimal number that is encoded.
        """
        exponent, first, second = (chromosomes[:, gene::3] for gene in range(3))
        # Both powers are exact doubles, and one of them is 1, so this rounds once.
        power = exponent + (_LARGEST_POWER - 2)
        parameters: Array = (10 * first + second) * _MULTIPLIER[power] / _DIVISOR[power]
        return parameters

    def code(self, chromosomes: IntArray) -> IntArray:
        """Number chromosomes in the order of their genes; different ones differ.

        Each word is a number whose digits are genes, counted from their smallest
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
        """Parameters of chromosomes from their codes, as `decode` has them.

        Parameters
        ----------
        codes : (n_words, ...)

        Returns
        -------
        (..., n_parameters)
        """
        parameters = np.empty((self.genes // _GENES, *codes.shape[1:]))
        rest = codes
        for parameter, values in enumerate(self._parameters_of):
            last = _GENES * parameter + _GENES - 1
            word, weight = self._word[last], int(self._weight[last])
            if parameter == 0 or word != self._word[last - _GENES]:
                rest = codes[word]
            which = rest // weight if weight > 1 else rest
            if weight > 1:
                rest = rest - which * weight
            values.take(which, out=parameters[parameter], mode="clip")
        return np.moveaxis(parameters, 0, -1)

    def crossed(self, parents: IntArray, cut: IntArray) -> IntArray:
        """Both children of each pair: all genes from the cut on are swapped.

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
        """Give genes of some chromosomes another value, in place.

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
        """How many values each gene has."""
        return self.high - self.low + 1

    @cached_property
    def _word(self) -> IntArray:
        """Word of each gene; the genes of a parameter share one."""
        words, filled = [0], 1
        for genes in self.values.reshape(-1, _GENES).tolist():
            filled *= prod(genes)
            if filled > 2**WORD_BITS:
                words.append(words[-1] + 1)
                filled = prod(genes)
            else:
                words.append(words[-1])
        return np.repeat(words[1:], _GENES)

    @cached_property
    def _words(self) -> int:
        return int(self._word[-1]) + 1

    @cached_property
    def _weight(self) -> IntArray:
        """What a step of each gene counts in its word."""
        weights = np.ones(self.genes, dtype=np.int64)
        for gene in range(self.genes - 2, -1, -1):
            if self._word[gene] == self._word[gene + 1]:
                weights[gene] = weights[gene + 1] * self.values[gene + 1]
        return weights

    @cached_property
    def _modulus(self) -> IntArray:
        """What is left of a word, modulo this, are the genes from a cut on; (n_words, n_genes)."""
        moduli = np.empty((self._words, self.genes), dtype=np.int64)
        for word in range(self._words):
            own = np.flatnonzero(self._word == word)
            every = self._weight[own[0]] * self.values[own[0]]
            moduli[word] = np.where(np.arange(self.genes) < own[0], every, 1)
            moduli[word, own] = self._weight[own] * self.values[own]
        return moduli

    @cached_property
    def _parameters_of(self) -> list[Array]:
        """All values of each parameter, by the number that its genes are."""
        bounds = zip(
            self.low.reshape(-1, _GENES).tolist(),
            self.high.reshape(-1, _GENES).tolist(),
            strict=True,
        )
        return [_all_values(tuple(low), tuple(high)) for low, high in bounds]


@lru_cache(maxsize=64)
def _all_values(low: tuple[int, ...], high: tuple[int, ...]) -> Array:
    """Values of a parameter in the order of its genes, (n_values,)."""
    ranges = [np.arange(least, most + 1) for least, most in zip(low, high, strict=True)]
    genes = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, _GENES)
    values: Array = Genome(np.array(low), np.array(high)).decode(genes)[:, 0]
    return values


_GENES = 3
"""Genes of a parameter."""

WORD_BITS = 48
"""A word of a code is below two to this power."""

# The largest power of ten that is an exact double.
_LARGEST_POWER = 22
_POWERS = range(-_LARGEST_POWER, _LARGEST_POWER + 1)
_MULTIPLIER = np.array([10.0 ** max(power, 0) for power in _POWERS])
_DIVISOR = np.array([10.0 ** max(-power, 0) for power in _POWERS])


def genome_of(model: SampleModel, ranges: dict[str, GeneRange]) -> Genome:
    """Genome of a sample model.

    Parameters
    ----------
    model
        Gives the order of the parameters.
    ranges
        Gene ranges by the name of the range, see `Parameter.range_name`.
    """
    chosen = [ranges[parameter.range_name] for parameter in model.parameters]
    low = [gene for r in chosen for gene in (r.exponent[0], r.digit[0], r.digit[0])]
    high = [gene for r in chosen for gene in (r.exponent[1], r.digit[1], r.digit[1])]
    return Genome(np.array(low, dtype=np.int64), np.array(high, dtype=np.int64))


def nearest_encodable(value: float, genes: GeneRange) -> float:
    """Return the number closest to a positive value that the genes can encode."""
    digits = range(genes.digit[0], genes.digit[1] + 1)
    exponents = range(genes.exponent[0], genes.exponent[1] + 1)
    candidates = (_value(e, a, b) for e in exponents for a in digits for b in digits)
    return min(candidates, key=lambda candidate: abs(candidate - value))


def _value(exponent: int, first: int, second: int) -> float:
    return float(f"{10 * first + second}e{exponent - 2}")
