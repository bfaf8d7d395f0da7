import itertools

import pytest

from biogrip.stages.batches import Batch, parse_batch, plan_batches, seeds_a_batch


def names(*arguments: object) -> list[str]:
    return [batch.name for batch in plan_batches(*arguments)]  # type: ignore[arg-type]


def test_batches_are_cut_at_multiples_of_the_size() -> None:
    assert names(50, 25) == ["seeds_0-24", "seeds_25-49"]
    assert names(7, 3) == ["seeds_0-2", "seeds_3-5", "seeds_6-6"]
    assert names(1, 100) == ["seeds_0-0"]


def test_raising_the_seeds_keeps_every_finished_batch() -> None:
    finished = plan_batches(50, 25)
    grown = plan_batches(130, 25, finished)
    assert grown[:2] == finished
    # An odd end is kept too, and the gap after it filled up to the next multiple.
    odd = plan_batches(60, 25)
    assert [b.name for b in plan_batches(130, 25, odd)][2:4] == ["seeds_50-59", "seeds_60-74"]


def test_lowering_the_seeds_keeps_the_batch_that_goes_beyond() -> None:
    assert names(40, 25, plan_batches(50, 25)) == ["seeds_0-24", "seeds_25-49"]


def test_another_batch_size_keeps_what_there_is() -> None:
    assert names(10, 4, [Batch(0, 5)]) == ["seeds_0-5", "seeds_6-7", "seeds_8-9"]


@pytest.mark.parametrize("seeds", [1, 5, 24, 25, 26, 60])
@pytest.mark.parametrize("size", [1, 3, 25, 1000])
def test_every_seed_is_covered_once_whatever_exists(seeds: int, size: int) -> None:
    pool = [Batch(0, 4), Batch(3, 6), Batch(5, 9), Batch(20, 30), Batch(70, 80), Batch(24, 24)]
    for count in range(4):
        for existing in itertools.combinations(pool, count):
            plan = plan_batches(seeds, size, existing)
            covered = [seed for batch in plan for seed in batch.seeds]
            assert covered == list(range(len(covered)))
            assert len(covered) >= seeds
            # What exists is kept, unless another that starts before has some of its seeds.
            before = [batch for batch in existing if batch.first < seeds]
            clear = [b for b in before if not any(o < b and o.last >= b.first for o in before)]
            assert set(clear) <= set(plan)
            # Half-way through, the plan does not change: a restarted run continues.
            assert plan_batches(seeds, size, [*existing, *plan[::2]]) == plan


def test_very_many_seeds_make_larger_batches_not_more() -> None:
    assert seeds_a_batch(1) == seeds_a_batch(2000) == 250
    for seeds in (2_001, 2_999, 8_000):
        assert len(plan_batches(seeds, seeds_a_batch(seeds))) == 8
    # But none that would take much memory.
    assert seeds_a_batch(100_000) == seeds_a_batch(1_000_000) == 1000


def test_names_are_read_back() -> None:
    assert parse_batch("seeds_50-74") == Batch(50, 74)
    assert parse_batch("seeds_50") is None
