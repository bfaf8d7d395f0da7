"""The genetic algorithm: what it does, and that populations side by side are as if alone."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array, IntArray
from biogrip.fit.problem import Fit, GeneRange, History, TraceProblem
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.sample_model import with_fixed
from biogrip_study.methods import genetic
from biogrip_study.methods.genetic import GeneticSettings, select
from biogrip_study.methods.genome import (
    Genome,
    encodable_values,
    lowest_encodable,
    nearest_encodable,
)
from biogrip_study.methods.misfit import series_of
from tests.helpers.problems import clean, pose_noisy

SMALL = GeneticSettings(60, 30, "pairs", "once", 3, 0.5, 1, 4, 6, 25)
READINGS = {
    "as printed": SMALL,
    "rank": replace(SMALL, mating="rank"),
    "several genes": replace(SMALL, mutated_genes=3, mutation_probability=0.9),
    "survivors, too": replace(SMALL, mutants="all"),
    "no mutation": replace(SMALL, mutation_probability=0.0),
    "odd": replace(SMALL, population=41, survivors=7),
    "cut between parameters": replace(SMALL, cut="between"),
    "cut in each parameter": replace(SMALL, cut="each"),
    "few": replace(SMALL, population=9, survivors=8, min_generations=0, max_generations=40),
    "limit": replace(SMALL, max_generations=5),
    "no generation": replace(SMALL, min_generations=0, max_generations=0),
    "misfits of their own": replace(SMALL, population=10, survivors=5, max_generations=7),
    "the paper's population": GeneticSettings(500, 250, "pairs", "once", 20, 0.5, 1, 5, 10, 200),
}
MAXWELL = MODELS["generalized_maxwell"]
MODELS_SEARCHED = {
    **{name: MODELS[name] for name in ("generalized_maxwell", "liquid_drop", "damper", "burgers")},
    "two branches": Sample("generalized_maxwell", 2).model,
    "k_p known": with_fixed(MAXWELL, {"k_p": 12.3}),
}
POPULATIONS = [*READINGS, *MODELS_SEARCHED]
STIFFNESS, DAMPING = GeneRange((-3, 8), (1, 9)), GeneRange((-4, 5), (1, 9))
RANGES = {"k": STIFFNESS, "k_p": STIFFNESS, "c": DAMPING, "c_p": DAMPING}
GENOME = Genome(tuple(RANGES[p.range_name] for p in MAXWELL.parameters))


@pytest.mark.parametrize("digits", [2, 6])
def test_the_best_are_selected_and_the_lowest_genes_of_equals(digits: int) -> None:
    ranges = {name: GeneRange((-16, 18), (0, 9), digits) for name in ("k", "k_p", "c", "c_p")}
    genome, rng = (
        Genome(tuple(ranges[p.range_name] for p in MAXWELL.parameters)),
        np.random.default_rng(8),
    )
    chromosomes = genome.draw(3 * 500, rng).reshape(3, 500, -1)
    chromosomes[:, 1::3, :-2] = chromosomes[:, :1, :-2]
    ranking = rng.integers(0, 40, size=(3, 500)).astype(np.float32)
    ranking[0, 5:90], ranking[1, :20], ranking[2, 7] = np.inf, np.nan, 0.0
    kept, values = select(chromosomes, ranking, 130)
    for population in range(3):
        keys = (*chromosomes[population].T[::-1], ranking[population])
        order = np.lexsort(keys)[:130]
        np.testing.assert_array_equal(kept[population], chromosomes[population, order])
        np.testing.assert_array_equal(values[population], ranking[population, order])


def decoded(genome: Genome, chromosomes: IntArray) -> Array:
    columns = np.split(chromosomes.T, np.cumsum(genome.sizes)[:-1])
    words = ([f"{''.join(map(str, d))}e{e - len(d)}" for e, *d in own.T] for own in columns)
    return np.array([*words], float).T


def gene_by_gene(posed: TraceProblem, settings: GeneticSettings, rng: np.random.Generator) -> Fit:
    """One population by itself, in single precision; of equals the lowest genes are first."""
    misfit = series_of([posed.residuals]) or posed.residuals.misfit
    genome = Genome(posed.ranges)

    def ranked(everyone: IntArray) -> tuple[IntArray, Array]:
        ranking = misfit(decoded(genome, everyone)).astype(np.float32)
        order = np.lexsort((*everyone.T[::-1], ranking))[: settings.survivors]
        return everyone[order], ranking[order].astype(float)

    def mutated(some: IntArray) -> IntArray:
        chosen = np.flatnonzero(rng.random(len(some)) < settings.mutation_probability)
        for _ in range(settings.mutated_genes):
            gene = rng.integers(len(genome.low), size=len(chosen))
            some[chosen, gene] = rng.integers(genome.low[gene], genome.high[gene], endpoint=True)
        return some

    survivors, ranking = ranked(genome.draw(settings.population, rng))
    rows, evaluations = [], settings.population
    generation = improved = 0
    while True:
        rows.append((survivors[0], ranking[0], ranking[len(ranking) // 2], evaluations))
        waits = generation < settings.min_generations or generation - improved < settings.patience
        if generation == settings.max_generations or not waits:
            break
        generation += 1
        children = crossed(survivors, genome.sizes, settings, rng)
        if generation >= settings.mutation_start:
            children = mutated(children)
            if settings.mutants == "all":
                others = mutated(survivors[1:].copy())
                survivors, children = survivors[:1], np.concatenate((children, others))
        evaluations += len(children)
        before = ranking[0]
        survivors, ranking = ranked(np.concatenate((survivors, children)))
        improved = generation if ranking[0] < before else improved
    fittest, lowest, median, counts = map(np.array, zip(*rows, strict=True))
    history = History(lowest, median, decoded(genome, fittest), counts)
    ended = "stalled" if generation < settings.max_generations else "generation limit"
    best = history.best_parameters[-1]
    return Fit(best, float(lowest[-1]), generation, evaluations, ended, history)


def crossed(
    parents: IntArray, sizes: Any, settings: GeneticSettings, rng: np.random.Generator
) -> IntArray:
    wanted, (count, genes) = settings.population - settings.survivors, parents.shape
    pairs = -(-wanted // 2)
    if settings.mating == "rank":
        rank = np.arange(count, 0, -1)
        drawn = rng.choice(count, size=(pairs, 2), p=rank / rank.sum())
    else:
        even = count // 2 * 2
        rounds = [rng.permutation(count)[:even] for _ in range(-(-2 * pairs // even))]
        drawn = np.concatenate(rounds)[: 2 * pairs].reshape(pairs, 2)
    starts = np.cumsum([0, *sizes])
    if settings.cut == "each":
        cuts = rng.integers(0, sizes, size=(pairs, len(sizes)), endpoint=True)
    elif settings.cut == "between":
        cuts = rng.choice(starts[1:-1], size=(pairs, 1))
    else:
        cuts = rng.integers(1, genes - 1, size=(pairs, 1), endpoint=True)
    both = zip(np.vstack((drawn, drawn[:, ::-1])), np.vstack((cuts, cuts)), strict=True)
    children = []
    for (one, other), cut in both:
        child = parents[other].copy()
        if settings.cut == "each":
            for start, own in zip(starts[:-1], cut, strict=True):
                child[start : start + own] = parents[one][start : start + own]
        else:
            child[: cut[0]] = parents[one][: cut[0]]
        children.append(child)
    return np.array(children)[:wanted]


def posed(count: int, model: Any = MAXWELL, **assumed: Any) -> list[TraceProblem]:
    return pose_noisy(*clean("endothelial_cell"), count, model, **assumed)


def rng_of(seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, 5])


def content(answer: Fit) -> tuple[bytes | float | str, ...]:
    arrays = vars(answer.history).values()
    numbers = answer.misfit, answer.generations, answer.evaluations, answer.stop_reason
    types = (str(array.dtype) for array in arrays)
    return (*numbers, answer.parameters.tobytes(), *(a.tobytes() for a in arrays), *types)


@pytest.mark.parametrize("name", POPULATIONS)
def test_populations_are_what_they_are_alone_and_gene_by_gene(name: str) -> None:
    """Children are cut and swapped parents, of half of which a gene is drawn anew; and so on."""
    settings, problems = READINGS.get(name, SMALL), posed(3, MODELS_SEARCHED.get(name, MAXWELL))
    if name == "the paper's population":
        # Larger than what is looked at together: seeds stop one after the other.
        problems = posed(5)
    if name == "misfits of their own":
        problems = posed(3, offset=True, drift=True)
    plain = [content(gene_by_gene(each, settings, rng_of(n))) for n, each in enumerate(problems)]
    everyone = list(range(len(problems)))
    for group in (everyone[::-1], everyone[1:], everyone[:1]):
        rngs = [rng_of(seed) for seed in group]
        found = genetic.identify_many([problems[seed] for seed in group], settings, rngs)
        assert [content(answer) for answer in found] == [plain[seed] for seed in group]


def test_genes_are_drawn_uniformly_from_their_whole_range() -> None:
    chromosomes = GENOME.draw(20_000, np.random.default_rng(1))
    assert (GENOME.low[:3].tolist(), GENOME.high[:3].tolist()) == ([-3, 1, 1], [8, 9, 9])
    for gene in range(len(GENOME.low)):
        values, counts = np.unique(chromosomes[:, gene], return_counts=True)
        assert values.tolist() == list(range(GENOME.low[gene], GENOME.high[gene] + 1))
        expected = 20_000 / len(values)
        assert np.abs(counts - expected).max() < 5 * np.sqrt(expected)


@pytest.mark.parametrize("digits", range(1, 7))
@pytest.mark.parametrize("digit", [(1, 9), (0, 9), (3, 5)])
def test_any_number_of_digits_is_decoded_as_a_decimal(digits: int, digit: tuple[int, int]) -> None:
    ranges = {**RANGES, "k": GeneRange((-16, 16), digit, digits)}
    genome = Genome(tuple(ranges[p.range_name] for p in MAXWELL.parameters))
    assert len(genome.low) == 9 + 1 + digits
    chromosomes = genome.draw(300, np.random.default_rng(digits))
    assert np.all(chromosomes[:, 1] > 0)
    np.testing.assert_array_equal(genome.decode(chromosomes), decoded(genome, chromosomes))
    ends = genome.decode(np.stack((genome.low, genome.high)))[:, 0]
    assert ends.tolist() == [ranges["k"].low, ranges["k"].high]


@pytest.mark.parametrize("value", [1e-9, 0.0999, 10.0, 12.34567, 302.5, 1.0e12])
@pytest.mark.parametrize("digits", [1, 3, 4])
def test_nearest_encodable_is_the_nearest_of_all(value: float, digits: int) -> None:
    genes = GeneRange((-2, 4), (0, 9), digits)
    mantissas, exponents = range(10 ** (digits - 1), 10**digits), range(-2, 5)
    every = (float(f"{m}e{exponent - digits}") for m in mantissas for exponent in exponents)
    nearest = min(abs(each - value) for each in every)
    assert abs(nearest_encodable(value, genes) - value) == nearest


def test_zeros_in_front_reach_below_the_smallest_number_without() -> None:
    """Written out: 0.01 to 0.99, and 0.1 to 9.9 in steps of 0.1, each number once and ascending."""
    genes = GeneRange((0, 1), (0, 9), first_digit=0)
    hundredths = {*range(1, 100), *(10 * tenth for tenth in range(1, 100))}
    np.testing.assert_allclose(
        encodable_values(genes), np.array(sorted(hundredths)) / 100, rtol=1e-15
    )
    assert (genes.low, genes.high, nearest_encodable(0.056, genes)) == (0.01, 9.9, 0.06)
    # Chromosomes of zeros alone are zero.
    assert genes.least == (0, 0, 0)


@pytest.mark.parametrize("digit", [0, 1])
def test_no_encodable_point_is_lower_where_the_optimum_is_not_encodable(digit: int) -> None:
    """In a valley across both parameters, whose bottom no digits can hold; and at an end."""
    ranges = [GeneRange((0, 2), (digit, 9), 2), GeneRange((-1, 1), (digit, 9), 2)]

    def valley(parameters: Array) -> Array:
        first, second = np.log(parameters / [33.73, 0.2843]).T
        return np.sqrt(1 + 100 * (first + second) ** 2 + first**2)

    def beyond(parameters: Array) -> Array:
        return np.log(1e5 / parameters).sum(axis=1)

    every = np.array(list(product(*(encodable_values(genes) for genes in ranges))))
    for each in (valley, beyond):
        found = lowest_encodable(each, ranges, np.array([[33.73, 0.2843]]))
        assert found == each(every).min() > 1 + 1e-6


@pytest.mark.parametrize("digit", [0, 1])
def test_the_first_digit_is_searched_with_the_second_kept(digit: int) -> None:
    """From 24 to 74, where every other second digit is worse."""

    def rungs(parameters: Array) -> Array:
        first, second = np.divmod(np.rint(parameters[:, 0]), 10)
        return 1.0 + abs(first - 7) + 10 * (second != 4)

    assert lowest_encodable(rungs, [GeneRange((2, 2), (digit, 9), 2)], np.array([[24.0]])) == 1


@pytest.mark.parametrize("gray", [False, True])
def test_bits_are_equal_steps_of_the_logarithm(gray: bool) -> None:
    """Of 1.1e-4 to 9.9e7 in 2^4 - 1 steps; by Gray's code, n ^ (n >> 1), neighbours differ in one
    bit."""
    genes = GeneRange((-3, 8), (1, 9), bits=4, gray=gray)
    numbers = np.arange(16)
    written = numbers ^ (numbers >> 1) if gray else numbers
    chromosomes = written[:, None] >> np.arange(4)[::-1] & 1
    genome = Genome((genes,))
    assert (genome.low.tolist(), genome.high.tolist()) == ([0] * 4, [1] * 4)
    found = genome.decode(chromosomes)[:, 0]
    np.testing.assert_allclose(found, np.geomspace(1.1e-4, 9.9e7, 16), rtol=1e-12)
    np.testing.assert_array_equal(found, encodable_values(genes))
    mixed = Genome(tuple((RANGES | {"c": genes})[p.range_name] for p in MAXWELL.parameters))
    assert mixed.sizes.tolist() == [3, 3, 4, 3]
    rows = np.array([[1, 9, 5, 2, 1, 2, *chromosomes[5], -2, 1, 1]])
    np.testing.assert_allclose(mixed.decode(rows)[0], [9.5, 12, found[5], 0.0011], rtol=1e-12)
