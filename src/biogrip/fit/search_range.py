"""Search ranges of parameters, as values of genes: exponent and digits (eq. 10, Tables 3, 4)."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.keys import Block, Complaint


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


def _value(genes: tuple[int, ...]) -> float:
    digits = "".join(map(str, genes[1:]))
    return float(f"{digits}e{genes[0] - len(digits)}")
