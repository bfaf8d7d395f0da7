"""How the paper's genetic algorithm is read."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GeneticSettings:
    """How the population evolves.

    Parameters
    ----------
    population
        Individuals in a generation.
    survivors
        The best so many live on unchanged and are the parents.
    mating
        ``"pairs"``: the survivors form random disjoint pairs; ``"rank"``:
        parents are drawn with a probability proportional to their rank.
    first_cut, last_cut
        Crossover point: the number of genes kept from the first parent is drawn
        uniformly from this range. Negative numbers count from the end: -1 is one
        less than the chromosome has.
    mutation_start
        First generation in which children mutate.
    mutation_probability
        Share of children that mutate.
    mutated_genes
        Genes redrawn in a child that mutates.
    patience
        Stop after so many generations without a better best misfit.
    min_generations, max_generations
        Never stop before, always stop at.
    """

    population: int
    survivors: int
    mating: str
    first_cut: int
    last_cut: int
    mutation_start: int
    mutation_probability: float
    mutated_genes: int
    patience: int
    min_generations: int
    max_generations: int
