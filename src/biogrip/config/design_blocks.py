"""Config of samples for which a protocol is to be designed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated

from pydantic import Field

from biogrip.config.trace_blocks import CaseName, CommonBlocks, ExperimentBlocks, SampleBlocks
from biogrip.keys import Block, Complaint, Distinct, below, unknown_names

MOST_CASES = 2000

SHARED = tuple(block.name for block in fields(ExperimentBlocks))
"""Blocks that may be given for all samples, and in a case for it alone."""


@dataclass(frozen=True, kw_only=True)
class DesignBlock(Block):
    """Limits of the trains of steps that `biogrip design` tries, and what they are to tell."""

    steps: Annotated[int, Field(ge=1, le=50)] = 8
    """Number of steps at most. By default 8."""
    largest: Annotated[float | None, Field(ge=1e-50, le=1e12)] = None
    """Largest torque, or what else the protocol holds, in its SI unit. By default the protocol's
    largest."""
    duration_s: Annotated[float | None, Field(ge=1e-6, le=1e9)] = None
    """Duration. By default the protocol's."""
    traces: Annotated[int, Field(ge=1, le=10)] = 1
    """Traces of each sample, each under steps of its own, which are fitted together. By default
    1."""
    parameters: Distinct[Annotated[tuple[str, ...], Field(max_length=40)]] = ()
    """Parameters asked for; the others are unknown all the same. By default all that are not
    fixed."""


@dataclass(frozen=True, kw_only=True)
class CasesBlocks(CommonBlocks):
    """Samples, and the limits of a design for them."""

    cases: Annotated[Mapping[CaseName, SampleBlocks], Field(min_length=1, max_length=MOST_CASES)]
    """Samples by name."""
    only: Distinct[Annotated[tuple[str, ...], Field(max_length=MOST_CASES)]] = ()
    """Names of the cases to run or design for; the others are left out. By default all under
    `cases`."""
    design: DesignBlock = field(default_factory=DesignBlock)

    def complaints(self) -> Iterator[Complaint]:
        """Find samples that do not fit between the jaws, and names of nothing that there is."""
        for name, case in self.cases.items():
            yield from below(("cases", name), case.comb_complaints(self.actuator))
        searched = [p.name for case in self.cases.values() for p in case.searched]
        yield from unknown_names(("only",), self.only, self.cases)
        asked = self.design.parameters
        yield from unknown_names(("design", "parameters"), asked, dict.fromkeys(searched))


@dataclass(frozen=True, kw_only=True)
class DesignConfig(CasesBlocks, ExperimentBlocks):
    """Samples, what is known of their experiment, and the limits of the design."""
