"""Populations that evolve side by side are, to the byte, what they are alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.fit import genetic, genetic_refined
from biogrip.fit.genetic import GeneticSettings, best, redraws
from biogrip.fit.genome import WORD_BITS, GeneRange, Genome
from biogrip.fit.problem import Identification, Problem, make_problem
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import SampleModel, with_fixed
from tests.helpers.plain_genetic import identified
from tests.helpers.problems import condensed_of

SMALL = GeneticSettings(60, 30, "pairs", 1, -1, 3, 0.5, 1, 4, 6, 25)
READINGS = {
    "as printed": SMALL,
    "rank": replace(SMALL, mating="rank"),
    "several genes": replace(SMALL, mutated_genes=3, mutation_probability=0.9),
    "no mutation": replace(SMALL, mutation_probability=0.0),
    "odd": replace(SMALL, population=41, survivors=7, first_cut=3, last_cut=3),
    "few": replace(SMALL, population=9, survivors=8, min_generations=0, max_generations=40),
    "limit": replace(SMALL, max_generations=5),
    "no generation": replace(SMALL, min_generations=0, max_generations=0),
}
RANGES = {
    **dict.fromkeys(("k", "k_p"), GeneRange((-3, 8), (1, 9))),
    **dict.fromkeys(("c", "c_p"), GeneRange((-4, 5), (1, 9))),
}
MAXWELL = MODELS["generalized_maxwell"]
MODELS_SEARCHED = {
    **{name: MODELS[name] for name in ("generalized_maxwell", "liquid_drop", "damper", "burgers")},
    "two branches": Sample("generalized_maxwell", 2).model,
    "k_p known": with_fixed(MAXWELL, {"k_p": 12.3}),
}


def case_problem(
    gripper: Gripper,
    steps: TorqueHistory,
    count: int,
    model: SampleModel = MAXWELL,
    **how: Any,
) -> list[Problem]:
    """As many noisy traces of Table 5's sample, which share what is the same for all."""
    time_s = np.arange(401.0)
    network = MAXWELL.network(np.array([35.0, 12.3, 299.9, 1e-3]))
    response = step_response(gripper, network, symmetric=steps.symmetric)
    clean = rotation(response, steps, time_s)[0]
    noise = np.random.default_rng(3).standard_normal((count, len(time_s)))
    traces = clean + 0.1 * clean.max() * noise
    shared = condensed_of(steps, time_s, **how)
    return [
        make_problem(gripper, model, steps, time_s, trace, RANGES, shared, instrument=GRIPPER)
        for trace in traces
    ]


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, 5])


def content(answer: Identification) -> tuple[bytes | float | str, ...]:
    history = answer.history
    return (
        answer.parameters.tobytes(),
        answer.misfit_rad,
        answer.generations,
        answer.evaluations,
        answer.stop_reason,
        *(array.tobytes() for array in vars(history).values()),
        *(str(array.dtype) for array in vars(history).values()),
    )


def assert_same_in_groups(problems: list[Problem], settings: GeneticSettings) -> None:
    alone = [
        content(genetic.identify_many([problem], settings, [rng(seed)])[0])
        for seed, problem in enumerate(problems)
    ]
    everyone = list(range(len(problems)))
    for groups in ([everyone], [everyone[::-1]], [everyone[:1], everyone[1:]]):
        for group in groups:
            found = genetic.identify_many(
                [problems[seed] for seed in group], settings, [rng(seed) for seed in group]
            )
            assert [content(answer) for answer in found] == [alone[seed] for seed in group]


@pytest.mark.parametrize("reading", READINGS)
def test_every_reading(reading: str, gripper: Gripper, steps: TorqueHistory) -> None:
    problems = case_problem(gripper, steps, 5)
    assert_same_in_groups(problems, READINGS[reading])
    for seed, problem in enumerate(problems):
        plain = identified(problem.misfit, problem.genome, READINGS[reading], rng(seed))
        (found,) = genetic.identify_many([problem], READINGS[reading], [rng(seed)])
        assert content(found) == content(plain)


@pytest.mark.parametrize("name", MODELS_SEARCHED)
def test_every_kind_of_model(name: str, gripper: Gripper, steps: TorqueHistory) -> None:
    problems = case_problem(gripper, steps, 3, MODELS_SEARCHED[name])
    assert_same_in_groups(problems, SMALL)
    (first, *_) = problems
    plain = identified(first.misfit, first.genome, SMALL, rng(0))
    (found,) = genetic.identify_many([first], SMALL, [rng(0)])
    assert content(found) == content(plain)


def test_misfits_that_form_the_responses(gripper: Gripper, steps: TorqueHistory) -> None:
    few = replace(SMALL, population=10, survivors=5, max_generations=7)
    assert_same_in_groups(case_problem(gripper, steps, 3, offset=True, drift=True), few)


def test_the_papers_budget(gripper: Gripper, steps: TorqueHistory) -> None:
    """Larger than what is looked at together: seeds stop one after the other."""
    settings = GeneticSettings(500, 250, "pairs", 1, -1, 20, 0.5, 1, 20, 40, 200)
    assert_same_in_groups(case_problem(gripper, steps, 8), settings)


def test_polished_populations(gripper: Gripper, steps: TorqueHistory) -> None:
    settings = genetic_refined.RefinedSettings(
        replace(SMALL, max_generations=8), genetic_refined.Polishing(2, 1)
    )
    problems = case_problem(gripper, steps, 2)
    polished = genetic_refined.identify_many
    alone = [polished([p], settings, [rng(s)])[0] for s, p in enumerate(problems)]
    found = polished(problems, settings, [rng(0), rng(1)])
    assert [content(answer) for answer in found] == [content(answer) for answer in alone]


def test_progress_is_of_all_together(gripper: Gripper, steps: TorqueHistory) -> None:
    told: list[tuple[int, float]] = []
    found = genetic.identify_many(
        case_problem(gripper, steps, 3),
        SMALL,
        [rng(s) for s in range(3)],
        lambda *now: told.append(now),
    )
    assert told[-1][0] == sum(answer.evaluations for answer in found)
    assert len(told) == max(answer.generations for answer in found)
    assert told[0][1] >= min(answer.misfit_rad for answer in found)


def wide(values: int) -> Genome:
    low = np.arange(12, dtype=np.int64) - 5
    return Genome(low, low + values - 1, (3,) * 4)


@pytest.mark.parametrize("values", [1, 2, 9, 2**30 + 1, 2**31 - 2**20, 2**31 + 1, 2**40])
@pytest.mark.parametrize("times", [1, 3])
def test_redrawn_genes_are_those_of_numpy(values: int, times: int) -> None:
    """A quarter of the words is of no use for just above 2^30 values, half for 2^31."""
    genome, counts = wide(values), [0, 40, 3, 100]
    ours, numpys = ([rng(seed) for seed in range(4)] for _ in range(2))
    drawn = redraws(genome, counts, times, ours)
    expected = []
    for count, generator in zip(counts, numpys, strict=True):
        own = np.empty((times, 2, count), dtype=np.int64)
        for turn in own:
            turn[0] = generator.integers(12, size=count)
            turn[1] = generator.integers(genome.low[turn[0]], genome.high[turn[0]], endpoint=True)
        expected.append(own)
    np.testing.assert_array_equal(drawn, np.concatenate(expected, axis=2))
    for generator, reference in zip(ours, numpys, strict=True):
        assert generator.bit_generator.state == reference.bit_generator.state


@pytest.mark.parametrize(("words", "size"), [(1, 500), (1, 40_000), (2, 300)])
def test_the_best_in_order(words: int, size: int) -> None:
    generator = np.random.default_rng(8)
    codes = generator.integers(0, 2**WORD_BITS, size=(words, 3, size))
    codes[:, :, ::3] = codes[:, :, :1]
    ranking = generator.integers(0, 40, size=(3, size)).astype(np.float32)
    ranking[0, 5:90], ranking[1, :20], ranking[2, 7] = np.inf, np.nan, 0.0
    kept, values = best(codes, ranking, 130)
    for population in range(3):
        order = np.lexsort((*codes[::-1, population], ranking[population]))[:130]
        np.testing.assert_array_equal(kept[:, population], codes[:, population, order])
        np.testing.assert_array_equal(values[population], ranking[population, order])
