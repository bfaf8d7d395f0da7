"""Division of the seeds of a case into batches, one per job."""

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

# Least and most seeds of a job, and the number of jobs aimed at in between, as the key batch_size
# says.
_SMALLEST, _LARGEST, _USUAL = 500, 1000, 8
_NAME = re.compile(r"seeds_(\d+)-(\d+)")


def seeds_of(batch: str) -> range:
    """Return the seeds of a batch, whose name has the first and the last, e.g. ``seeds_0-24``."""
    found = _NAME.fullmatch(batch)
    assert found, batch
    return range(int(found[1]), int(found[2]) + 1)


def batch_names(seeds: int, batch_size: int | None = None, folder: Path | None = None) -> list[str]:
    """Return the names of the batches of a case.

    Seeds are cut at multiples of the batch size, by default one that makes start-up a small part of
    a job. Batches that a folder has files of are kept, so that more seeds renew none of them.
    """
    size = batch_size or min(max(_SMALLEST, -(-seeds // _USUAL)), _LARGEST)
    there = folder.glob("seeds_*") if folder else ()
    existing = sorted((r.start, r.stop) for r in map(seeds_of, _stems(there)))
    edges, covered = [], 0
    for first, stop in existing:
        if covered <= first < stop <= seeds:
            edges += [*_cut(covered, first, size), (first, stop)]
            covered = stop
    edges += _cut(covered, seeds, size)
    return [f"seeds_{first}-{stop - 1}" for first, stop in edges]


def _stems(files: Iterable[Path]) -> list[str]:
    return [file.stem for file in files if _NAME.fullmatch(file.stem)]


def _cut(start: int, stop: int, size: int) -> list[tuple[int, int]]:
    """Cut seeds start to stop - 1 at multiples of size."""
    edges = [start, *range((start // size + 1) * size, stop, size), stop]
    return [(a, b) for a, b in pairwise(edges) if a < b]
