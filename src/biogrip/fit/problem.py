"""The identification of one trace: its search ranges, its problem, and its result."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array, IntArray
from biogrip.keys import Block, Complaint
from biogrip.physics.residuals import Residuals
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


ReportProgress = Callable[[float], None]
"""Callback that receives the share of the work that is done, 0 to 1."""


HistoryRow = tuple[Array, float, float, int]
"""Row of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def silent(share: float) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class History:
    """Course of an identification, step by step; the method defines what a step is."""

    best_misfit: Array
    """Lowest misfit so far in the unit of the readings, (n_steps + 1,)."""
    median_misfit: Array
    """Median over the method's population or fits, (n_steps + 1,)."""
    best_parameters: Array
    """Parameters of the lowest misfit, (n_steps + 1, n_parameters)."""
    evaluations: IntArray
    """Responses simulated so far, (n_steps + 1,)."""

    @classmethod
    def of(cls, rows: Sequence[HistoryRow]) -> "History":
        """Assemble a history from its rows."""
        parameters, best_misfit, median_misfit, counts = map(np.array, zip(*rows, strict=True))
        return cls(best_misfit, median_misfit, parameters, counts)


@dataclass(frozen=True)
class Fit:
    """The result of identifying one trace by one method."""

    parameters: Array
    """Parameters of lowest misfit, (n_parameters,)."""
    misfit: float
    """RMS misfit of these parameters."""
    generations: int
    """Number of steps: generations, or local fits."""
    evaluations: int
    """Number of simulated responses, with derivatives or not."""
    stop_reason: str
    """Reason why the method stopped."""
    history: History = field(repr=False)
    """Course of the identification; that of what was fitted first, where more fits followed."""
    converged: bool = True
    """False if the last local fit did not converge."""

    def in_order(self, model: SampleModel) -> "Fit":
        """Return a copy with Maxwell branches sorted by relaxation time, in its history as well."""
        way = self.history.best_parameters
        ordered = np.take_along_axis(way, model.in_order(way), axis=1)
        parameters = self.parameters[model.in_order(self.parameters[None])[0]]
        history = replace(self.history, best_parameters=ordered)
        return replace(self, parameters=parameters, history=history)


@dataclass(frozen=True)
class TraceProblem:
    """The identification of one trace, in the form that every method takes."""

    residuals: Residuals
    """Residuals with exact derivatives, and misfits, as functions of log-parameters."""
    low: Array
    """Logarithms of the lower ends of the search range (Table 4), (n_parameters,)."""
    high: Array
    """Those of the upper ends."""
    ranges: tuple[GeneRange, ...]
    """Search range of each parameter, as genes."""


def make_problem(residuals: Residuals, ranges: Mapping[str, GeneRange]) -> TraceProblem:
    """Set up a problem from its residuals, and search ranges by `Parameter.range_name`."""
    chosen = tuple(ranges[parameter.range_name] for parameter in residuals.model.parameters)
    low, high = (np.log([getattr(genes, end) for genes in chosen]) for end in ("low", "high"))
    return TraceProblem(residuals, low, high, chosen)
