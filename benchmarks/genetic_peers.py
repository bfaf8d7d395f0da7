"""The paper's genetic algorithm in the libraries of others.

Each has the operators of `biogrip_study.methods.genetic` as nearly as its interface allows, and as
fast: truncation selection, random disjoint pairs, single-point crossover, and from `mutation_start`
on one gene redrawn in half of the children. All see the same misfit of whole batches.
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
from pymoo.operators.selection.rnd import RandomSelection
from pymoo.optimize import minimize

from biogrip.arrays import Array, IntArray
from biogrip_study.methods.genetic import GeneticSettings
from biogrip_study.methods.genome import Genome

creator.create("Misfit", base.Fitness, weights=(-1.0,))
creator.create("Chromosome", list, fitness=creator.Misfit)


@dataclass(frozen=True)
class Task:
    """What is to be minimised, and how; the population evolves for ``max_generations``."""

    misfit: Callable[[Array], Array]
    genome: Genome
    settings: GeneticSettings

    def of(self, chromosomes: IntArray) -> Array:
        """Misfit of chromosomes."""
        return self.misfit(self.genome.decode(chromosomes))


def by_deap(task: Task, seed: int) -> float:
    """Run the loop of DEAP's overview, whose ``map`` evaluates a whole batch; the lowest misfit.

    Children start as new lists, not as deep copies, which are slow.
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
    lowest: float = tools.selBest(population, 1)[0].fitness.values[0]
    return lowest


def by_pygad(task: Task, seed: int) -> float:
    """Run PyGAD on batches, with callables on arrays; the lowest misfit.

    Its crossover makes one child of each two parents that follow one another. It does not evaluate
    a child that equals a parent.
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

    run = pygad.GA(
        num_generations=settings.max_generations,
        num_parents_mating=settings.survivors,
        keep_elitism=settings.survivors,
        gene_type=int,
        fitness_func=lambda run, chromosomes, indices: -task.of(chromosomes),
        fitness_batch_size=settings.population,
        initial_population=genome.draw(settings.population, rng),
        parent_selection_type=parents,
        crossover_type="single_point",
        mutation_type=mutated,
        random_seed=seed,
        suppress_warnings=True,
    )
    run.run()
    return -float(run.best_solution(run.last_generation_fitness)[1])


def by_pymoo(task: Task, seed: int) -> float:
    """Run pymoo's genetic algorithm, and keep children that are there already; lowest misfit."""
    settings, genome = task.settings, task.genome
    algorithm = GA(
        pop_size=settings.survivors,
        n_offsprings=settings.population - settings.survivors,
        sampling=genome.draw(settings.population, np.random.default_rng(seed)),
        selection=_AmongSurvivors(settings.survivors),
        crossover=SinglePointCrossover(prob=1.0),
        mutation=_OneGene(genome, settings),
        eliminate_duplicates=False,
        advance_after_initial_infill=True,
    )
    # pymoo counts the initial population as the first generation.
    generations = settings.max_generations + 1
    return float(minimize(_Minimised(task), algorithm, ("n_gen", generations), seed=seed).F[0])


class _Minimised(Problem):  # type: ignore[misc]
    def __init__(self, task: Task) -> None:
        genome = task.genome
        super().__init__(n_var=len(genome.low), n_obj=1, xl=genome.low, xu=genome.high, vtype=int)
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
    gene = rng.integers(len(genome.low), size=len(chosen))
    chromosomes[chosen, gene] = rng.integers(genome.low[gene], genome.high[gene], endpoint=True)
