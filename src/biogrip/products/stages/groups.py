"""Traces that are worked on together: enough to gain by it, few enough for little memory."""

from collections.abc import Iterator, Sequence

_TOGETHER = 63


def groups(seeds: Sequence[int], times: int = 1) -> Iterator[Sequence[int]]:
    """Yield the seeds of a batch, some at a time; no result depends on which these are."""
    count = times * _TOGETHER
    for first in range(0, len(seeds), count):
        yield seeds[first : first + count]
