"""Groups of traces that are fitted together, small enough for little memory."""

from collections.abc import Iterator, Sequence

_JOINT = 63


def groups(seeds: Sequence[int], times: int = 1) -> Iterator[Sequence[int]]:
    """Yield the seeds of a batch in groups; results do not depend on the grouping."""
    count = times * _JOINT
    for first in range(0, len(seeds), count):
        yield seeds[first : first + count]
