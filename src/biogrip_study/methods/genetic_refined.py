"""The genetic algorithm, followed by local fits of log-parameters from its survivors.

The last survivors lie in one basin. The survivors of the initial population lie in
all basins, so local fits start from the best of both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.fit.least_squares import best_of_starts
from biogrip.fit.problem import Fit, History, HistoryRow, ReportProgress, TraceProblem, silent
from biogrip.keys import Block
from biogrip_study.methods.genetic import GeneticSettings, evolve


@dataclass(frozen=True)
class Polishing(Block):
    """Local fits from survivors of the genetic algorithm."""

    first: Annotated[int, Field(ge=0, le=10_000)]
    """Number of the best survivors of the initial population that are polished."""
    last: Annotated[int, Field(ge=1, le=10_000)]
    """The same for the last population."""


def identify_many(
    problems: Sequence[TraceProblem],
    settings: tuple[GeneticSettings, Polishing],
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress = silent,
) -> list[Fit]:
    """Identify samples of one model by the genetic algorithm and local fits from its survivors."""
    genetic, polishing = settings
    evolutions = evolve(problems, genetic, rngs, progress)
    starts: list[Array] = []
    before: list[HistoryRow] = []
    for coarse, first, last in evolutions:
        starts.append(np.log(np.concatenate((last[: polishing.last], first[: polishing.first]))))
        median = float(coarse.history.median_misfit[-1])
        before.append((coarse.parameters, coarse.misfit, median, coarse.evaluations))
    fine = best_of_starts(problems, starts, before, progress)
    return [_polished(coarse, own) for (coarse, _, _), own in zip(evolutions, fine, strict=True)]


def _polished(coarse: Fit, fine: Fit) -> Fit:
    """Append the fits' history, but for its first row, to that of the generations."""
    columns = zip(vars(coarse.history).values(), vars(fine.history).values(), strict=True)
    return replace(
        fine,
        generations=coarse.generations + fine.generations,
        stop_reason=f"{coarse.stop_reason}, polished",
        history=History(*(np.concatenate((first, then[1:])) for first, then in columns)),
    )
