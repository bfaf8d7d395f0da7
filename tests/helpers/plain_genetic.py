"""The genetic algorithm gene by gene, one population at a time."""

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.genetic import GeneticSettings
from biogrip.fit.genome import Genome
from biogrip.fit.problem import Fit, History, TraceProblem
from biogrip.physics.misfit import make_misfit


def decoded(genome: Genome, chromosomes: IntArray) -> Array:
    """Parameters of chromosomes, read as decimal numbers."""
    columns = np.split(chromosomes.T, np.cumsum(genome.sizes)[:-1])
    return np.array([[_number(*genes) for genes in own.T.tolist()] for own in columns]).T


def _number(exponent: int, *digits: int) -> float:
    return float(f"{''.join(map(str, digits))}e{exponent - len(digits)}")


def identified(posed: TraceProblem, settings: GeneticSettings, rng: np.random.Generator) -> Fit:
    misfit, genome = make_misfit(posed.residuals), posed.genome

    def ranked(everyone: IntArray) -> tuple[IntArray, Array]:
        ranking = misfit(decoded(genome, everyone)).astype(np.float32)
        order = np.lexsort((*everyone.T[::-1], ranking))[: settings.survivors]
        return everyone[order], ranking[order].astype(float)

    survivors, ranking = ranked(genome.draw(settings.population, rng))
    rows = [(survivors[0], ranking[0], ranking[len(ranking) // 2])]
    counts = [settings.population]
    generation = improved = 0
    reason = "generation limit"
    while generation < settings.max_generations:
        if generation >= settings.min_generations and generation - improved >= settings.patience:
            reason = "stalled"
            break
        generation += 1
        children = _children(survivors, settings, rng)
        if generation >= settings.mutation_start:
            _mutate(children, genome, settings, rng)
            if settings.mutants == "all":
                best, others = np.split(survivors.copy(), [1])
                _mutate(others, genome, settings, rng)
                survivors, children = best, np.concatenate((children, others))
        counts.append(counts[-1] + len(children))
        survivors, new = ranked(np.concatenate((survivors, children)))
        improved = generation if new[0] < ranking[0] else improved
        ranking = new
        rows.append((survivors[0], ranking[0], ranking[len(ranking) // 2]))
    fittest, lowest, median = map(np.array, zip(*rows, strict=True))
    history = History(lowest, median, decoded(genome, fittest), np.array(counts))
    ended = float(lowest[-1]), generation, counts[-1], reason
    return Fit(history.best_parameters[-1], *ended, history)


def _children(parents: IntArray, settings: GeneticSettings, rng: np.random.Generator) -> IntArray:
    wanted = settings.population - settings.survivors
    pairs = -(-wanted // 2)
    count, genes = parents.shape
    if settings.mating == "rank":
        rank = np.arange(count, 0, -1)
        drawn = rng.choice(count, size=(pairs, 2), p=rank / rank.sum())
    else:
        even = count // 2 * 2
        rounds = [rng.permutation(count)[:even] for _ in range(-(-2 * pairs // even))]
        drawn = np.concatenate(rounds)[: 2 * pairs].reshape(pairs, 2)
    ends = settings.first_cut, settings.last_cut
    first, last = (min(cut if cut > 0 else genes + cut, genes - 1) for cut in ends)
    cuts = rng.integers(min(first, last), last, size=pairs, endpoint=True)
    both = zip(np.vstack((drawn, drawn[:, ::-1])), np.tile(cuts, 2), strict=True)
    heads = [np.append(parents[one][:cut], parents[other][cut:]) for (one, other), cut in both]
    return np.array(heads)[:wanted]


def _mutate(
    children: IntArray, genome: Genome, settings: GeneticSettings, rng: np.random.Generator
) -> None:
    chosen = np.flatnonzero(rng.random(len(children)) < settings.mutation_probability)
    for _ in range(settings.mutated_genes):
        gene = rng.integers(genome.genes, size=len(chosen))
        children[chosen, gene] = rng.integers(genome.low[gene], genome.high[gene], endpoint=True)
