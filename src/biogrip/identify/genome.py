"""The chromosome: three integer genes a parameter (eq. 10, Tables 3 and 4)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.sample import SampleModel


@dataclass(frozen=True)
class GeneRange:
    """Values that the genes of one parameter may take (Table 3).

    Parameters
    ----------
    exponent
        Lowest and highest order of magnitude g_1.
    digit
        Lowest and highest value of the digits g_2 and g_3.
    """

    exponent: tuple[int, int]
    digit: tuple[int, int]

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
        """Number chromosomes so that different ones have different numbers.

        Returns
        -------
        (n_words, n)
            Fifteen genes a word, for sorting and comparing.
        """
        shifted = chromosomes - self.low
        return np.array([shifted[:, genes] @ weights for genes, weights in self._words])

    @cached_property
    def _words(self) -> list[tuple[slice, IntArray]]:
        """Genes of each word, and what a step of each of them counts."""
        words = []
        for start in range(0, self.genes, _GENES_A_WORD):
            genes = slice(start, start + _GENES_A_WORD)
            span = (self.high - self.low + 1)[genes]
            words.append((genes, np.concatenate((np.cumprod(span[:0:-1])[::-1], [1]))))
        return words


# Five parameters of the widest range, (37 * 9 * 9)^5, stay below 2^63.
_GENES_A_WORD = 15
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
