"""Division of the seeds of a case into batches, one per job."""

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from biogrip.study.config import LARGEST_BATCH, SMALLEST_BATCH, USUAL_BATCHES


class Batch(NamedTuple):
    """A range of seeds from first to last, both included."""

    first: int
    last: int

    @property
    def name(self) -> str:
        """Name used in files, e.g. ``seeds_0-24``."""
        return f"seeds_{self.first}-{self.last}"

    @property
    def seeds(self) -> list[int]:
        """All seeds of the batch."""
        return list(range(self.first, self.last + 1))


def parse_batch(name: str) -> Batch | None:
    """Return the batch that a name stands for, or None if the name has another form."""
    match = re.fullmatch(r"seeds_(\d+)-(\d+)", name)
    return Batch(int(match[1]), int(match[2])) if match else None


def plan_batches(seeds: int, batch_size: int, existing: Iterable[Batch] = ()) -> list[Batch]:
    """Divide seeds 0 to ``seeds - 1`` into batches, keeping existing ones.

    Seeds without a batch are cut at multiples of the batch size. Existing batches are kept
    whole, so raising the number of seeds recomputes none of them, and an interrupted run continues
    with the batches it started with. Of two that overlap, the one that starts first is kept.
    """
    plan: list[Batch] = []
    covered = 0
    for batch in sorted(existing):
        if batch.first >= seeds:
            break
        if covered <= batch.first <= batch.last:
            plan += _cut(covered, batch.first, batch_size)
            plan.append(batch)
            covered = batch.last + 1
    return plan + _cut(covered, seeds, batch_size)


def seeds_a_batch(seeds: int) -> int:
    """Return the default number of seeds per batch.

    It is large enough that start-up is a small part of a job and that jobs are not too many, and
    small enough for little memory.
    """
    return min(max(SMALLEST_BATCH, -(-seeds // USUAL_BATCHES)), LARGEST_BATCH)


def existing_batches(folder: Path) -> list[Batch]:
    """Return the batches that have a result file in a folder."""
    found = (parse_batch(file.stem) for file in folder.glob("seeds_*.csv"))
    return [batch for batch in found if batch]


def _cut(start: int, stop: int, size: int) -> list[Batch]:
    """Cut seeds start to stop - 1 at multiples of size."""
    edges = [start, *range((start // size + 1) * size, stop, size), stop]
    return [Batch(a, b - 1) for a, b in pairwise(edges) if a < b]


def batch_names(seeds: int) -> list[str]:
    """Return the names of the batches of a case."""
    return [batch.name for batch in plan_batches(seeds, seeds_a_batch(seeds))]
