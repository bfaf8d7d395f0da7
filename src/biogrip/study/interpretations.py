"""Interpretations: alternative interpretations of the paper, each tried on all simulated cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from biogrip.keys import Block, Printed
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.plain import plain
from biogrip.study.source import overlaid


@dataclass(frozen=True)
class InterpretationBlock(Block):
    """An alternative interpretation of the paper: changes to every simulated case."""

    title: Printed
    """Name in print."""
    changes: Mapping[str, Any]
    """Merged into each case, with keys of a case, e.g. `genetic_algorithm: {patience: 60}`."""


def read_blocks(
    interpretations: Mapping[str, InterpretationBlock], cases: Mapping[str, CaseBlock]
) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield each interpretation, simulated case and the case's block under it, as plain data."""
    for interpretation, block in interpretations.items():
        for name, case in cases.items():
            if not case.recorded:
                yield interpretation, name, overlaid(plain(case), block.changes)
