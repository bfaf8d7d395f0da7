"""The chromosome: three integer genes a parameter (eq. 10, Tables 3 and 4)."""

from dataclasses import dataclass

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
        exponent, first, second = np.moveaxis(chromosomes.reshape(len(chromosomes), -1, 3), 2, 0)
        power = exponent - 2
        mantissa = (10 * first + second).astype(float)
        # Powers of ten up to 1e22 are exact doubles, so one division or product rounds once.
        scale = _POWERS_OF_TEN[np.abs(power)]
        return np.where(power < 0, mantissa / scale, mantissa * scale)

    def code(self, chromosomes: IntArray) -> IntArray:
        """Number chromosomes so that different ones have different numbers.

        Returns
        -------
        (n_words, n)
            Fifteen genes a word, for sorting and comparing.
        """
        words = []
        for start in range(0, self.genes, _GENES_A_WORD):
            here = slice(start, start + _GENES_A_WORD)
            span = (self.high - self.low + 1)[here]
            weight = np.concatenate((np.cumprod(span[:0:-1])[::-1], [1]))
            words.append((chromosomes[:, here] - self.low[here]) @ weight)
        return np.array(words)


# Five parameters of the widest range, (37 * 9 * 9)^5, stay below 2^63.
_GENES_A_WORD = 15
_POWERS_OF_TEN = np.array([float(f"1e{power}") for power in range(23)])


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
