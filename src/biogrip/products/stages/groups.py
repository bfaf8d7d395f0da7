"""Traces that are worked on together: enough to gain by it, few enough for little memory."""

from collections.abc import Iterator, Sequence

_TOGETHER = 63


def groups(seeds: Sequence[int]) -> Iterator[Sequence[int]]:
    """Yield the seeds of a batch, some at a time; no result depends on which these are."""
    for first in range(0, len(seeds), _TOGETHER):
        yield seeds[first : first + _TOGETHER]
