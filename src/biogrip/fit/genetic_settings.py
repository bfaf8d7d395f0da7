"""Settings of the paper's genetic algorithm."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from biogrip.digits import counted
from biogrip.keys import Block, Problem

_MOST = 1_000_000


@dataclass(frozen=True)
class GeneticSettings(Block):
    """Settings of the genetic algorithm (section 4)."""

    population: Annotated[int, Field(ge=4, le=_MOST)]
    """Individuals in a generation."""
    survivors: Annotated[int, Field(ge=2, le=_MOST)]
    """Number of the best, which survive unchanged and are the parents of the others."""
    mating: Literal["pairs", "rank"]
    """`pairs`: survivors form random disjoint pairs; `rank`: parents are drawn with a probability
    proportional to their rank."""
    first_cut: Annotated[int, Field(ge=1, le=50)]
    """Smallest number of genes that a child takes from its first parent."""
    last_cut: Annotated[int, Field(ge=-50, le=50)]
    """Largest number of genes that a child takes from its first parent. Negative numbers count from
    the end; -1 is one less than the chromosome has, 11 with twelve genes."""
    mutation_start: Annotated[int, Field(ge=1, le=_MOST)]
    """First generation whose children mutate."""
    mutation_probability: Annotated[float, Field(ge=0, le=1)]
    """Share of the children that mutate."""
    mutated_genes: Annotated[int, Field(ge=1, le=50)]
    """Number of times that a gene of such a child is chosen and redrawn from its range."""
    patience: Annotated[int, Field(ge=1, le=_MOST)]
    """Stop after this number of generations without improvement of the best misfit."""
    min_generations: Annotated[int, Field(ge=0, le=_MOST)]
    """Fewest generations."""
    max_generations: Annotated[int, Field(ge=1, le=_MOST)]
    """Most generations."""
    mutants: Literal["children", "all"] = "children"
    """Individuals that may mutate: `children`; or `all`, survivors except the best, too."""

    def problems(self) -> Iterator[Problem]:
        """Find settings that leave no children, or whose limits of generations conflict."""
        if self.survivors >= self.population:
            text = f"found {self.survivors}, allowed is less than population"
            yield ("survivors",), f"{text}, which is {self.population}."
        if self.min_generations > self.max_generations:
            text = f"found {self.min_generations}, allowed is at most max_generations"
            yield ("min_generations",), f"{text}, which is {self.max_generations}."

    def problems_of(self, genes: int) -> Iterator[Problem]:
        """Find crossover cuts that a chromosome of `genes` genes cannot have."""
        last = self.last_cut if self.last_cut > 0 else genes + self.last_cut
        if genes and not 1 <= self.first_cut <= last:
            text = f"found {self.first_cut}, allowed is 1 to last_cut, "
            yield ("first_cut",), f"{text}which is {last} of {counted(genes, 'gene')} here."
