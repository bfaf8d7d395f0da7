"""Climbing from the best trains of steps: what may change, and that nothing beside is better."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from biogrip.arrays import Array, IntArray
from biogrip.design.bursts import whole
from biogrip.design.climb import climb
from biogrip.design.criteria import Criterion
from biogrip.design.exchange import exchanged
from biogrip.design.experiment import compute_information
from biogrip.design.few_bins import in_few_bins
from biogrip.design.neighbours import NEW, Train, neighbour, random_train, train_of, without
from biogrip.design.rating import Rater, Torque
from biogrip.design.sampling import best_sampling, least_bound
from biogrip.design.schedule import Plan, planned, presses
from biogrip.design.search import best_torques
from biogrip.design.within_reach import plan_within_reach
from biogrip.identify.answer import silent
from tests.design.test_plan import DROP

# Drop 2 of the paper, whose published design is of few steps.
SECOND = replace(DROP, parameters=np.array([[1.0, 1e-4, 10.0, 1e-3]]), samples=4001)


@pytest.mark.parametrize("seed", range(5))
def test_neighbours_keep_to_the_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    limits = DROP.limits
    train = random_train(limits, rng)
    changed = 0
    for _ in range(400):
        other = neighbour(train, limits, rng)
        if other is None:
            continue
        changed += 1
        assert other.train.units.min() >= 1
        assert other.train.units.sum() == 40_000
        assert len(other.train.units) == len(other.train.levels) == len(other.origins)
        assert len(other.train.units) <= limits.most_steps
        assert np.all((other.train.levels >= 0) & (other.train.levels <= 1))
        kept = other.origins[other.origins != NEW]
        assert np.all(np.diff(kept) > 0)
        assert np.all(kept < len(train.units))
        train = other.train
    assert changed > 200


def test_every_number_of_steps_is_reached_from_any_other() -> None:
    rng = np.random.default_rng(1)
    train = Train(np.array([40_000]), np.ones(1))
    counts = set()
    for _ in range(600):
        if (other := neighbour(train, DROP.limits, rng)) is not None:
            train = other.train
            counts.add(len(train.units))
    assert counts == set(range(1, 9))


def test_a_step_that_is_left_out_leaves_its_time_to_the_next() -> None:
    train = Train(np.array([3, 4, 5]), np.array([1.0, 0.5, 0.7]))
    other = without(train, 1, 2)
    assert other.train.units.tolist() == [3, 9]
    assert other.train.levels.tolist() == [1.0, 0.7]
    assert other.origins.tolist() == [0, 2]


def test_a_train_is_what_its_waveform_holds() -> None:
    train = Train(np.array([3, 4, 39_993]), np.array([1.0, 0.5, 0.7]))
    again = train_of(train.waveform(DROP.limits), DROP.limits)
    np.testing.assert_array_equal(again.units, train.units)
    np.testing.assert_array_equal(again.levels, train.levels)


@cache
def _found() -> tuple[list[Torque], list[Torque]]:
    torques = best_torques(SECOND, 128, np.random.default_rng(1), silent)
    return torques, climb(SECOND, torques, 600, np.random.default_rng(2), silent)


def _bound(torque: Torque) -> float:
    return float(Rater(SECOND).rate(torque.waveform, gap=0.002, most=60).logarithm)


def test_what_is_climbed_to_is_better_by_far_and_the_same_again() -> None:
    torques, climbed = _found()
    assert _bound(climbed[0]) < _bound(torques[0]) - 0.05
    again = climb(SECOND, torques, 600, np.random.default_rng(2), silent)
    np.testing.assert_array_equal(again[0].waveform.levels, climbed[0].waveform.levels)
    np.testing.assert_array_equal(again[0].waveform.durations_s, climbed[0].waveform.durations_s)


def test_of_random_trains_none_is_better() -> None:
    rng = np.random.default_rng(3)
    rater = Rater(SECOND)
    bounds = [
        rater.rate(random_train(SECOND.limits, rng).waveform(SECOND.limits)).logarithm
        for _ in range(200)
    ]
    assert min(bounds) > _bound(_found()[1][0])


def test_a_whole_design_is_no_worse_for_climbing() -> None:
    """From the same search; the jaws still press."""
    _, plan = plan_within_reach(SECOND, 128, np.random.default_rng(1), silent, neighbours=200)
    before = planned(SECOND, _found()[0])
    assert SECOND.typical_bound(plan.information) <= SECOND.typical_bound(before.information)
    assert presses(SECOND, plan.phases)


@cache
def _plan() -> Plan:
    return planned(SECOND, _found()[1])


def test_the_gap_is_that_of_the_readings_that_are_printed() -> None:
    """No list of real instants of this torque beats them by more, of many that are drawn near."""
    plan = _plan()
    ours = SECOND.typical_bound(plan.information)
    history = SECOND.history(plan.phases)
    rng = np.random.default_rng(4)
    slots = np.rint(plan.time_s * SECOND.fastest_Hz).astype(int)
    lowest = np.inf
    for _ in range(60):
        moved = np.where(
            rng.random(len(slots)) < 0.02 * rng.random(),
            np.rint(slots * np.exp(0.1 * rng.normal(size=len(slots)))),
            slots,
        )
        drawn = np.clip(np.unique(moved), 1, 40_000_000 - 1)
        rows = SECOND.sensitivities(history, drawn / SECOND.fastest_Hz)
        # A list in which readings coincide is shorter; information grows with their number.
        information = compute_information(rows) * len(slots) / len(drawn)
        lowest = min(lowest, SECOND.typical_bound(information))
    assert plan.gap < 0.01
    assert lowest > ours / (1 + plan.gap)


def test_no_filling_falls_below_the_least_bound() -> None:
    rng = np.random.default_rng(5)
    rows = np.exp(-np.linspace(0.05, 4, 40) * rng.uniform(0.3, 3.0, (1, 3, 1))) * 10
    near = rows * rng.uniform(0.9, 1.1, rows.shape)
    capacity = rng.integers(1, 8, 40).astype(float)
    criterion = Criterion("largest", "worst", (0, 1, 2))
    best = best_sampling(rows, capacity, 60, criterion, gap=1e-3, most=300)
    alone = least_bound({1.0: [rows]}, capacity, best.samples, 60, criterion)
    bound = criterion.typical_bound(best.covariances)
    assert bound / (1 + 2e-3) < alone <= bound
    # Half of each cell's slots may be of other instants, and a sampling may choose among them.
    least = least_bound({0.5: [rows, near]}, capacity, best.samples, 60, criterion)
    both = np.concatenate((rows, near), axis=2)
    other = best_sampling(both, np.tile(capacity / 2, 2), 60, criterion, gap=1e-3, most=300)
    assert least < alone
    assert criterion.typical_bound(other.covariances) > least


def test_exchanges_mend_a_bad_rounding() -> None:
    """Few readings of which a quarter have gone to the wrong one of the cells that are used."""
    time = np.linspace(0.05, 4, 40)
    rows = 10 * np.exp(-np.array([0.3, 1.0, 2.5])[:, None] * time)[None]
    capacity = np.full(40, 9.0)
    criterion = Criterion("largest", "worst", (0, 1, 2))
    best = best_sampling(rows, capacity, 40, criterion, gap=1e-3, most=300)
    few = in_few_bins(rows, best.samples, capacity, np.arange(40) / 40)
    counts = whole(few, capacity)
    most, least = np.argmax(counts), np.flatnonzero(counts)[np.argmin(counts[counts > 0])]
    moved = min(int(counts[most]), int(capacity[least] - counts[least]), 5)
    counts[most] -= moved
    counts[least] += moved
    mended = exchanged(rows, counts, few, capacity, criterion)
    assert mended.sum() == 40
    assert np.all((mended >= 0) & (mended <= capacity))

    def bound(samples: Array | IntArray) -> float:
        information = (rows * samples) @ rows.swapaxes(1, 2)
        return criterion.typical_bound(np.linalg.inv(information))

    assert bound(counts) > 1.05 * bound(best.samples)
    # Of 40 readings one is 2.5 %, of which a bound has half.
    assert bound(mended) < 1.0125 * bound(best.samples)
