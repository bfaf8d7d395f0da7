"""The cheapest set of experiments, beside all sets that there are."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from biogrip.arrays import IntArray
from biogrip.design.price import PriceSettings
from biogrip.design.sets import SetProblem, enough, front, nothing_beats, repeated

EXPERIMENTS, CELLS, PARAMETERS, MOST = 5, 12, 3, 4


def problem_of(seed: int) -> SetProblem:
    """Return experiments that each tell of other parameters, and differently of each cell."""
    rng = np.random.default_rng(seed)
    slopes = rng.standard_normal((EXPERIMENTS, CELLS, PARAMETERS, 2))
    slopes *= np.exp(rng.normal(0, 0.7, (EXPERIMENTS, 1, PARAMETERS, 1)))
    slopes *= np.exp(rng.normal(0, 0.4, (1, CELLS, 1, 1)))
    costs = rng.integers(2, 12, EXPERIMENTS).astype(float)
    return SetProblem(slopes @ slopes.swapaxes(2, 3), costs, (0, 1, 2), 0.8, MOST)


def every_set() -> list[IntArray]:
    every = map(np.array, product(range(MOST + 1), repeat=EXPERIMENTS))
    return [counts for counts in every if counts.sum() <= MOST]


def known_by_inverse(problem: SetProblem, counts: IntArray) -> int:
    """Count cells by NumPy's pseudoinverse; a matrix that has none tells of nothing."""
    information = np.einsum("e,ecpq->cpq", counts, problem.information) + problem.before
    regular = np.linalg.matrix_rank(information) == PARAMETERS
    variances = np.diagonal(np.linalg.pinv(information), axis1=1, axis2=2)
    return int((regular & np.all(variances[:, problem.targets] <= problem.largest**2, 1)).sum())


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("before", [0.0, 0.6])
def test_no_set_is_cheaper(seed: int, before: float) -> None:
    problem = problem_of(seed)
    if before:
        targets = (0, 2)
        problem = replace(problem, targets=targets, before=before * np.eye(PARAMETERS)[None])
    every = [
        (float(counts @ problem.costs), known_by_inverse(problem, counts)) for counts in every_set()
    ]
    reached = max(known for _, known in every)
    assert reached > CELLS / 2
    for cells in range(2, CELLS + 1, 2):
        found = problem.cheapest(cells)
        if cells > reached:
            assert found is None
        else:
            assert found is not None
            assert found.cost == min(cost for cost, known in every if known >= cells)
            assert found.known.sum() == known_by_inverse(problem, found.counts) >= cells
            assert found.counts.sum() <= MOST


def test_what_is_known_already_takes_no_experiment() -> None:
    problem = replace(problem_of(0), before=4.0 * np.eye(PARAMETERS)[None])
    found = problem.cheapest(CELLS)
    assert found is not None
    assert (found.cost, found.share) == (0.0, 1.0)


def others_of(seed: int, cells: int = 200) -> tuple[SetProblem, SetProblem]:
    """Return experiments with few cells, and the same with many others like them."""
    rng = np.random.default_rng(seed)
    shape = EXPERIMENTS, CELLS + cells, PARAMETERS, 2
    slopes = rng.standard_normal((*shape[:1], 1, *shape[2:])) + 0.7 * rng.standard_normal(shape)
    information = slopes @ slopes.swapaxes(2, 3)
    costs = rng.integers(2, 12, EXPERIMENTS).astype(float)
    both = (information[:, :CELLS], information[:, CELLS:])
    problem, judged = (SetProblem(each, costs, (0, 1, 2), 0.9, 8) for each in both)
    return problem, judged


def test_sets_are_enough_for_cells_that_they_were_not_chosen_for() -> None:
    """The cheapest for the cells alone are not, of most problems."""
    short = 0
    for seed in range(4):
        problem, judged = others_of(seed)
        for share in (0.5, 0.8, 0.9):
            alone = problem.cheapest(enough(share, CELLS))
            assert alone is not None
            short += judged.made(alone.counts).share < share
            found = front(problem, judged, [share])
            assert found[0].cost == alone.cost
            assert [one.share >= share for one in found[:-1]] == [False] * (len(found) - 1)
            assert found[-1].share >= share
            assert len(found[-1].known) == 200
    assert short > 5


def test_where_no_set_is_enough_all_that_were_tried_are_there() -> None:
    problem, judged = others_of(0)
    hardly = replace(judged, information=judged.information * 1e-3)
    found = front(problem, hardly, [0.5])
    assert found
    assert max(one.share for one in found) < 0.5
    assert front(replace(problem, largest=1e-3), judged, [0.5]) == []


def test_repeating_one_is_beaten_by_no_other_repetition() -> None:
    problem = problem_of(2)
    alone = [counts for counts in every_set() if np.count_nonzero(counts) == 1]
    for one in repeated(problem):
        assert np.count_nonzero(one.counts) == 1
        known = one.known.sum()
        costs = [
            counts @ problem.costs for counts in alone if known_by_inverse(problem, counts) >= known
        ]
        assert one.cost == min(costs)


def test_sets_that_cost_more_and_tell_no_more_are_dropped() -> None:
    problem = problem_of(3)
    kept = nothing_beats([problem.made(counts) for counts in every_set()])
    every = [(counts @ problem.costs, known_by_inverse(problem, counts)) for counts in every_set()]
    for one in kept:
        known = one.known.sum()
        assert not any(cost <= one.cost and more > known for cost, more in every)


def test_enough_cells_are_no_fewer_than_asked_for() -> None:
    assert [enough(share, 20) for share in (0.95, 0.951, 1.0)] == [19, 20, 20]
    assert enough(0.95, 128) == 122


def test_costs_are_counted_as_defined() -> None:
    settings = PriceSettings(per_second=2.0, per_reading=0.5, per_change=3.0, per_experiment=7.0)
    assert settings.cost(10.0, 20, 4) == 20.0 + 10.0 + 12.0 + 7.0
    assert PriceSettings(per_change=3.0).cost(10.0, 20, 4) == 12.0
