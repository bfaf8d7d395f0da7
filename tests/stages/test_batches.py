from itertools import combinations
from pathlib import Path

import pytest

from biogrip.stages.job import batch_names, seeds_of


def made(folder: Path, *names: str) -> Path:
    """A folder with files of some batches."""
    for name in names:
        (folder / f"{name}.csv").touch()
    return folder


def test_batches_are_cut_at_multiples_of_the_size() -> None:
    assert batch_names(50, 25) == ["seeds_0-24", "seeds_25-49"]
    assert batch_names(7, 3) == ["seeds_0-2", "seeds_3-5", "seeds_6-6"]
    assert list(seeds_of("seeds_25-27")) == [25, 26, 27]


def test_batches_that_there_are_are_kept(tmp_path: Path) -> None:
    there = made(tmp_path, *batch_names(60, 25))
    # An odd end is kept too, and the gap after it filled up to the next multiple.
    assert batch_names(130, 25, there)[2:4] == ["seeds_50-59", "seeds_60-74"]
    # So are those of another size; one that goes beyond fewer seeds would bring its own in.
    assert batch_names(40, 10, there) == ["seeds_0-24", "seeds_25-29", "seeds_30-39"]


@pytest.mark.parametrize("seeds", [1, 5, 24, 25, 60])
@pytest.mark.parametrize("size", [1, 3, 25, 1000])
def test_every_seed_is_covered_once_whatever_there_is(
    tmp_path: Path, seeds: int, size: int
) -> None:
    pool = ["seeds_0-4", "seeds_3-6", "seeds_5-9", "seeds_20-30", "seeds_70-80", "seeds_24-24"]
    for number, existing in enumerate(combinations(pool, 2)):
        (folder := tmp_path / str(number)).mkdir()
        plan = batch_names(seeds, size, made(folder, *existing))
        covered = [seed for batch in plan for seed in seeds_of(batch)]
        assert covered == list(range(seeds))
        # Half-way through, the plan does not change: a restarted run continues.
        assert batch_names(seeds, size, made(folder, *plan[::2])) == plan


def test_very_many_seeds_make_larger_batches_not_more() -> None:
    assert len(batch_names(500)) == 1
    assert {len(batch_names(seeds)) for seeds in (4_001, 6_001, 8_000)} == {8}
    # But none that would take much memory.
    assert len(batch_names(1_000_000)) == 1000
