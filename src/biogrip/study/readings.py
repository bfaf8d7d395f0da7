"""Readings: alternative interpretations of the paper, each tried on all simulated cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from biogrip.keys import Block, Printed
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.plain import plain
from biogrip.study.source import overlaid


@dataclass(frozen=True)
class ReadingBlock(Block):
    """An alternative interpretation of the paper: changes to every simulated case."""

    title: Printed
    """Name in print."""
    changes: Mapping[str, Any]
    """Merged into each case, with keys of a case, e.g. `genetic_algorithm: {patience: 60}`."""


def read_blocks(
    readings: Mapping[str, ReadingBlock], cases: Mapping[str, CaseBlock]
) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield the config block of every simulated case under every reading, as plain data.

    Parameters
    ----------
    readings, cases
        Blocks of a study's config.

    Yields
    ------
    tuple
        Name of the reading, name of the case, and the block.
    """
    for reading, block in readings.items():
        for name, case in cases.items():
            if not case.recorded:
                yield reading, name, overlaid(plain(case), block.changes)
