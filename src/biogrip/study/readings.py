"""Readings: other ways to understand what the paper says, each tried on all simulated cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from biogrip.keys import Key, printed
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.source import overlaid
from biogrip.study.typed import plain


@dataclass(frozen=True)
class ReadingBlock:
    """What a reading takes to be different."""

    title: Annotated[str, printed("Name in print.")]
    changes: Annotated[
        Mapping[str, Any],
        Key(
            "Laid over each case, in the form of a case, e.g. `genetic_algorithm: {patience: 60}`."
        ),
    ]


def read_blocks(
    readings: Mapping[str, ReadingBlock], cases: Mapping[str, CaseBlock]
) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Blocks of the simulated cases under each reading, as a file would have them.

    Parameters
    ----------
    readings, cases
        Of a study.

    Yields
    ------
    tuple
        Names of the reading and of the case, and the block.
    """
    for reading, block in readings.items():
        for name, case in cases.items():
            if not case.recorded:
                yield reading, name, overlaid(plain(case), block.changes)
