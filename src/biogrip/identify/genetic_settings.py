"""Settings of the paper's genetic algorithm."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from biogrip.digits import counted
from biogrip.keys import Key, Problem

_MOST = 1_000_000


@dataclass(frozen=True)
class GeneticSettings:
    """Settings of the genetic algorithm (section 4)."""

    population: Annotated[int, Key("Individuals in a generation.", low=4, high=_MOST)]
    survivors: Annotated[
        int,
        Key(
            "Number of the best, which survive unchanged and are the parents of the others.",
            low=2,
            high=_MOST,
        ),
    ]
    mating: Annotated[
        str,
        Key(
            "`pairs`: survivors form random disjoint pairs; `rank`: parents are drawn with a "
            "probability proportional to their rank.",
            choices=("pairs", "rank"),
        ),
    ]
    first_cut: Annotated[
        int,
        Key("Smallest number of genes that a child takes from its first parent.", low=1, high=50),
    ]
    last_cut: Annotated[
        int,
        Key(
            "Largest number of genes that a child takes from its first parent. Negative numbers "
            "count from the end; -1 is one less than the chromosome has, 11 with twelve genes.",
            low=-50,
            high=50,
        ),
    ]
    mutation_start: Annotated[
        int, Key("First generation whose children mutate.", low=1, high=_MOST)
    ]
    mutation_probability: Annotated[float, Key("Share of the children that mutate.", low=0, high=1)]
    mutated_genes: Annotated[
        int,
        Key(
            "Number of times that a gene of such a child is chosen and redrawn from its range.",
            low=1,
            high=50,
        ),
    ]
    patience: Annotated[
        int,
        Key(
            "Stop after this number of generations without improvement of the best misfit.",
            low=1,
            high=_MOST,
        ),
    ]
    min_generations: Annotated[int, Key("Fewest generations.", low=0, high=_MOST)]
    max_generations: Annotated[int, Key("Most generations.", low=1, high=_MOST)]
    mutants: Annotated[
        str,
        Key(
            "Individuals that may mutate: `children`; or `all`, survivors except the best, too.",
            choices=("children", "all"),
        ),
    ] = "children"

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
