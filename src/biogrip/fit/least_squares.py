"""Bounded multi-start least squares on log-parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.multi_start import best_of_starts, screened
from biogrip.fit.problem import Identification, Problem, Progress, Row, silent
from biogrip.keys import Block


@dataclass(frozen=True)
class LeastSquaresSettings(Block):
    """Local fits from random points, the method of identifiability analyses, too."""

    candidates: Annotated[int, Field(ge=1, le=1_000_000)]
    """Points drawn, uniformly in the logarithms of the parameters."""
    starts: Annotated[int, Field(ge=1, le=10_000)]
    """Local fits, from the best of them."""


def identify_many(
    problems: Sequence[Problem],
    settings: LeastSquaresSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
    further: Sequence[Array] | None = None,
) -> list[Identification]:
    """Identify samples by local fits from the best of many random points.

    Parameters
    ----------
    problems, settings, rngs, progress
        As in `biogrip.fit.methods`; `progress` is called after every trace.
    further
        Additional starts of each trace, log-parameters (n_further, n_parameters).

    Raises
    ------
    BiogripError
        If the model has no response at any of the points.
    """
    pairs = zip(problems, rngs, strict=True)
    points = [_screened(problem, settings, rng) for problem, rng in pairs]
    starts, before = zip(*points, strict=True)
    if further is not None:
        starts = tuple(map(np.concatenate, zip(starts, further, strict=True)))
    return best_of_starts(problems, starts, before, progress)


def _screened(
    problem: Problem, settings: LeastSquaresSettings, rng: np.random.Generator
) -> tuple[Array, Row]:
    """Return the best random points as starts, and the first row of the history."""
    shape = (settings.candidates, len(problem.low))
    points, misfit = screened(problem.misfit, rng.uniform(problem.low, problem.high, shape))
    if not len(points):
        raise BiogripError(
            "least_squares: the model has no answer anywhere in the search range; "
            "allowed are smaller torques, or the linear model."
        )
    before = np.exp(points[0]), float(misfit[0]), float(np.median(misfit)), settings.candidates
    return points[: settings.starts], before
