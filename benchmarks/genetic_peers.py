"""The paper's genetic algorithm in the libraries of others.

Each in two ways. As documented: set up for integers as its documentation shows,
with its own operators and defaults, at the paper's population and survivors. Lean:
the operators of `biogrip.identify.genetic` as nearly as its interface allows, and as
fast: truncation selection, random disjoint pairs, single-point crossover, and from
`mutation_start` on one gene redrawn in half of the children. Either way it sees the
same misfit of whole batches.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pygad
from deap import base, creator, tools
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.mutation import Mutation
from pymoo.core.problem import Problem
from pymoo.operators.crossover.pntx import SinglePointCrossover
from pymoo.operators.mutation.pm import PM
from pymoo.operators.repair.rounding import RoundingRepair
from pymoo.operators.sampling.rnd import IntegerRandomSampling
from pymoo.operators.selection.rnd import RandomSelection
from pymoo.optimize import minimize

from biogrip.arrays import Array, IntArray
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.genome import Genome

creator.create("Misfit", base.Fitness, weights=(-1.0,))
creator.create("Chromosome", list, fitness=creator.Misfit)


@dataclass(frozen=True)
class Task:
    """What is to be minimised, and how.

    Parameters
    ----------
    misfit
        Of parameters of shape (n, n_parameters).
    genome
        What a chromosome may be.
    settings
        How the population evolves; it does so for ``max_generations``.
    """

    misfit: Callable[[Array], Array]
    genome: Genome
    settings: GeneticSettings

    def of(self, chromosomes: IntArray) -> Array:
        """Misfit of chromosomes."""
        return self.misfit(self.genome.decode(chromosomes))


def by_deap(task: Task, seed: int, *, documented: bool) -> tuple[IntArray, float]:
    """Run the loop of DEAP's overview, whose ``map`` evaluates a whole batch.

    Parameters
    ----------
    task, seed
        What to do.
    documented
        Whether children start as deep copies, DEAP's default, and each gene is
        redrawn by DEAP's own operator with its own probability, one a child on
        average; or they start as new lists, and one gene is redrawn.
    """
    settings, genome = task.settings, task.genome
    low, high = genome.low.tolist(), genome.high.tolist()
    random.seed(seed)

    def mutate(chromosome: list[int]) -> None:
        gene = random.randrange(len(chromosome))
        chromosome[gene] = random.randint(low[gene], high[gene])

    toolbox = base.Toolbox()
    toolbox.register("chromosome", lambda: creator.Chromosome(map(random.randint, low, high)))
    toolbox.register("population", tools.initRepeat, list, toolbox.chromosome)
    toolbox.register("evaluate", lambda batch: [(m,) for m in task.of(np.array(batch)).tolist()])
    toolbox.register("map", lambda evaluate, batch: evaluate(batch))
    toolbox.register("select", tools.selBest, k=settings.survivors)
    toolbox.register("mate", tools.cxOnePoint)
    if documented:
        toolbox.register("mutate", tools.mutUniformInt, low=low, up=high, indpb=1 / len(low))
    else:
        toolbox.register("clone", creator.Chromosome)
        toolbox.register("mutate", mutate)

    def evaluated(batch: list[Any]) -> list[Any]:
        for chromosome, value in zip(batch, toolbox.map(toolbox.evaluate, batch), strict=True):
            chromosome.fitness.values = value
        return batch

    population = evaluated(toolbox.population(n=settings.population))
    for generation in range(1, settings.max_generations + 1):
        survivors = toolbox.select(population)
        children = [toolbox.clone(chromosome) for chromosome in survivors]
        random.shuffle(children)
        for mother, father in zip(children[::2], children[1::2], strict=True):
            toolbox.mate(mother, father)
        if generation >= settings.mutation_start:
            for child in children:
                if random.random() < settings.mutation_probability:
                    toolbox.mutate(child)
        population = survivors + evaluated(children)
    (best,) = tools.selBest(population, 1)
    return np.array(best), best.fitness.values[0]


def by_pygad(task: Task, seed: int, *, documented: bool) -> tuple[IntArray, float]:
    """Run PyGAD on batches.

    Its crossover makes one child of each two parents that follow one another.
    It does not evaluate a child that equals a parent.

    Parameters
    ----------
    task, seed
        What to do.
    documented
        Whether initial population, selection and mutation are PyGAD's own, which
        mates neighbours in rank and mutates every child from the start; or
        callables on arrays.
    """
    settings, genome = task.settings, task.genome
    rng = np.random.default_rng(seed)

    def parents(fitness: Array, count: int, run: Any) -> tuple[IntArray, IntArray]:
        chosen = rng.permutation(np.argsort(-fitness, kind="stable")[:count])
        return run.population[chosen], chosen

    def mutated(children: IntArray, run: Any) -> IntArray:
        if run.generations_completed + 1 >= settings.mutation_start:
            _mutate(children, genome, rng, settings.mutation_probability)
        return children

    how: dict[str, Any]
    if documented:
        how = {
            "sol_per_pop": settings.population,
            "num_genes": genome.genes,
            "gene_space": [range(a, b + 1) for a, b in zip(genome.low, genome.high, strict=True)],
            "mutation_num_genes": settings.mutated_genes,
        }
    else:
        how = {
            "initial_population": genome.draw(settings.population, rng),
            "parent_selection_type": parents,
            "mutation_type": mutated,
        }
    run = pygad.GA(
        num_generations=settings.max_generations,
        num_parents_mating=settings.survivors,
        keep_elitism=settings.survivors,
        gene_type=int,
        fitness_func=lambda run, chromosomes, indices: -task.of(chromosomes),
        fitness_batch_size=settings.population,
        crossover_type="single_point",
        **how,
        random_seed=seed,
        suppress_warnings=True,
    )
    run.run()
    best, fitness, _ = run.best_solution(run.last_generation_fitness)
    return best, -fitness


def by_pymoo(task: Task, seed: int, *, documented: bool) -> tuple[IntArray, float]:
    """Run pymoo's genetic algorithm.

    Parameters
    ----------
    task, seed
        What to do.
    documented
        Whether it is set up as pymoo's page on discrete variables shows, with
        single-point crossover: tournaments, polynomial mutation of every child,
        numbers rounded, and children that are there already replaced; or with the
        paper's pairs and mutation on arrays, and such children kept.
    """
    settings, genome = task.settings, task.genome
    how: dict[str, Any]
    if documented:
        how = {
            "sampling": IntegerRandomSampling(),
            "crossover": SinglePointCrossover(prob=1.0, repair=RoundingRepair()),
            "mutation": PM(prob=1.0, eta=3.0, vtype=float, repair=RoundingRepair()),
            "eliminate_duplicates": True,
        }
    else:
        how = {
            "sampling": genome.draw(settings.population, np.random.default_rng(seed)),
            "selection": _AmongSurvivors(settings.survivors),
            "crossover": SinglePointCrossover(prob=1.0),
            "mutation": _OneGene(genome, settings),
            "eliminate_duplicates": False,
            "advance_after_initial_infill": True,
        }
    algorithm = GA(
        pop_size=settings.survivors, n_offsprings=settings.population - settings.survivors, **how
    )
    # pymoo counts the initial population as the first generation.
    generations = settings.max_generations + 1
    found = minimize(_Minimised(task), algorithm, ("n_gen", generations), seed=seed)
    return found.X, float(found.F[0])


class _Minimised(Problem):  # type: ignore[misc]
    def __init__(self, task: Task) -> None:
        genome = task.genome
        super().__init__(n_var=genome.genes, n_obj=1, xl=genome.low, xu=genome.high, vtype=int)
        self._task = task

    def _evaluate(self, x: IntArray, out: dict[str, Array], *args: Any, **kwargs: Any) -> None:
        out["F"] = self._task.of(x)


class _AmongSurvivors(RandomSelection):  # type: ignore[misc]
    """Random disjoint pairs of the best; only the initial population has others."""

    def __init__(self, survivors: int) -> None:
        super().__init__()
        self._survivors = survivors

    def _do(self, problem: Any, population: Any, *args: Any, **kwargs: Any) -> IntArray:
        return super()._do(problem, population[: self._survivors], *args, **kwargs)


class _OneGene(Mutation):  # type: ignore[misc]
    def __init__(self, genome: Genome, settings: GeneticSettings) -> None:
        super().__init__(prob=settings.mutation_probability)
        self._genome = genome
        self._start = settings.mutation_start

    def _do(self, problem: Any, x: IntArray, *args: Any, **kwargs: Any) -> IntArray:
        if kwargs["algorithm"].n_gen - 1 >= self._start:
            _mutate(x, self._genome, kwargs["random_state"], share=1.0)
        return x


def _mutate(chromosomes: IntArray, genome: Genome, rng: np.random.Generator, share: float) -> None:
    """Redraw one gene in a share of the chromosomes in place."""
    chosen = np.flatnonzero(rng.random(len(chromosomes)) < share)
    gene = rng.integers(genome.genes, size=len(chosen))
    chromosomes[chosen, gene] = rng.integers(genome.low[gene], genome.high[gene], endpoint=True)
