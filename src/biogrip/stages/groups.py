"""Groups of traces that are fitted together, small enough for little memory."""

from collections.abc import Iterator, Sequence

from biogrip.arrays import parts

_JOINT = 63


def groups(seeds: Sequence[int], times: int = 1) -> Iterator[Sequence[int]]:
    """Return the seeds of a batch in groups; results do not depend on the grouping."""
    return (seeds[some] for some in parts(len(seeds), times * _JOINT))
