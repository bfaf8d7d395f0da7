"""Which seeds go into which job."""

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from biogrip.study.config import LARGEST_BATCH, SMALLEST_BATCH, USUAL_BATCHES


class Batch(NamedTuple):
    """Seeds from first to last, both included."""

    first: int
    last: int

    @property
    def name(self) -> str:
        """Name in files, e.g. ``seeds_0-24``."""
        return f"seeds_{self.first}-{self.last}"

    @property
    def seeds(self) -> list[int]:
        """Return every seed of the batch."""
        return list(range(self.first, self.last + 1))


def parse_batch(name: str) -> Batch | None:
    """Return the batch of a name, or None if it is no batch's name."""
    match = re.fullmatch(r"seeds_(\d+)-(\d+)", name)
    return Batch(int(match[1]), int(match[2])) if match else None


def plan_batches(seeds: int, batch_size: int, existing: Iterable[Batch] = ()) -> list[Batch]:
    """Cover seeds 0 to ``seeds - 1`` with batches, keeping those that exist.

    Seeds without a batch are cut at the multiples of the batch size. Because
    what exists is kept whole, raising the number of seeds never redoes one, and
    a half-finished run is continued with the batches it was started with.

    Parameters
    ----------
    seeds, batch_size
        What to cover, in pieces of at most what size.
    existing
        Batches with results; where two overlap, the one that starts first counts.
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
    """Size of the batches of a case where the study does not say.

    Enough that starting a job is little beside its work and that there are not
    too many jobs to plan, and no more than fit into little memory.
    """
    return min(max(SMALLEST_BATCH, -(-seeds // USUAL_BATCHES)), LARGEST_BATCH)


def existing_batches(folder: Path) -> list[Batch]:
    """Batches with a result file in a folder."""
    found = (parse_batch(file.stem) for file in folder.glob("seeds_*.csv"))
    return [batch for batch in found if batch]


def _cut(start: int, stop: int, size: int) -> list[Batch]:
    """Cut seeds start to stop - 1 at the multiples of size."""
    edges = [start, *range((start // size + 1) * size, stop, size), stop]
    return [Batch(a, b - 1) for a, b in pairwise(edges) if a < b]
