"""Bounded multi-start least squares on log-parameters, for many traces at once [1]_.

The fits of traces with the same protocol, sampling times and model, from any number of starts, are
computed as one array (`LocalFits`). Local fits start from the best of many random points. All are
rough; the best few are continued to their optima. No result depends, to the last bit, on the other
fits. Steps that follow a flat valley to more digits would: what a trace does not determine would
hang on the last bits of a processor.

References
----------
.. [1] A. Raue et al., PLoS ONE 8 (2013), e74335: local fits from many starts.
"""

from bisect import insort
from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array, BoolArray, IntArray, parts
from biogrip.errors import BiogripError
from biogrip.fit.levenberg_marquardt import Constraint, Minima, Normal, minimize
from biogrip.fit.problem import Fit, History, HistoryRow, ReportProgress, TraceProblem, silent
from biogrip.keys import Block

PRIOR_WIDTH = 100.0
"""Standard deviation, in e-folds, of the Gaussian prior about the middle of each range. It changes
estimates by the square of (standard deviation / 100 e-folds), and places a parameter that the
trace does not inform, which rounding would place."""

ROUGH, FAIR, FINE = 1e-5, 1e-6, 1e-9
"""Relative decrease of the sum of squares below which a fit has converged, to tell basins, to give
chi^2 of some thousand readings to 0.01, and the optimum: far above rounding errors, and where the
grid of `levenberg_marquardt`, a thousandth of a standard deviation, ends most fits."""

# Most steps of fair fits with a quantity held.
_MOST_FAIR_STEPS = 40
# Most numbers in the rows that are formed at once.
_ROW_NUMBERS_AT_ONCE = 300_000


def alike(problems: Sequence[TraceProblem]) -> list[IntArray]:
    """Group the indices of problems that one `LocalFits` can fit together."""
    groups = defaultdict[Hashable, list[int]](list)
    for index, problem in enumerate(problems):
        groups[problem.residuals.of_responses].append(index)
    return [np.array(group) for group in groups.values()]


class LocalFits:
    """Local fits to several traces, whose problems have to be `alike`.

    The logarithms of the ends of the search range of each are `low` and `high`, (n_traces,
    n_parameters).
    """

    def __init__(self, problems: Sequence[TraceProblem]) -> None:
        self.problems = problems
        self.low = np.stack([problem.low for problem in problems])
        self.high = np.stack([problem.high for problem in problems])
        self._residuals = problems[0].residuals
        self._traces = np.stack([problem.residuals.trace.rows for problem in problems])
        # Not the noise that is stated: the optimum must not depend on what is believed of it.
        self._noise_sd = np.array([problem.residuals.trace.scatter for problem in problems])
        self._middle = 0.5 * (self.low + self.high)

    def normal(self, x: Array, trace: IntArray) -> Normal:
        """Return the normal equations of the residuals, in units of the noise, and the prior.

        Log-parameters are (n, n_parameters), each for a trace.
        """
        at_once = max(1, _ROW_NUMBERS_AT_ONCE // (self._traces.shape[1] * (1 + x.shape[1])))
        normals = [
            self._normal_of(self._residuals.condensed_responses(x[some]), x[some], trace[some])
            for some in parts(max(len(x), 1), at_once)
        ]
        return Normal.joined(normals) if len(normals) > 1 else normals[0]

    def _normal_of(self, rows: Array, x: Array, trace: IntArray) -> Normal:
        """Return normal equations from rows of responses; infinite where there is no response."""
        answered = np.isfinite(rows[:, 0, 0])
        rows[~answered] = 0.0
        rows[:, 0] -= self._traces[trace]
        products = rows @ rows.swapaxes(1, 2)
        misfit = np.sqrt(products[:, 0, 0] / self._residuals.samples)
        products /= (self._noise_sd[trace] ** 2)[:, None, None]
        away = (x - self._middle[trace]) / PRIOR_WIDTH
        diagonal = np.arange(1, 1 + x.shape[1])
        products[:, diagonal, diagonal] += 1 / PRIOR_WIDTH**2
        square_sum = products[:, 0, 0] + np.sum(away**2, axis=1)
        return Normal(
            np.where(answered, square_sum, np.inf),
            products[:, 0, 1:] + away / PRIOR_WIDTH,
            products[:, 1:, 1:],
            np.where(answered, misfit, np.inf),
        )

    def fitted(
        self,
        starts: Array,
        trace: IntArray,
        tolerance: float = FINE,
        *,
        constraint: Constraint | None = None,
        low: Array | None = None,
        high: Array | None = None,
    ) -> Minima:
        """Minimize the sum of squares from log-parameters, (n, n_parameters).

        These are moved into the bounds and onto the constraint if need be. Each is fitted to the
        trace of an index, (n,). Other bounds than the search range are (n, n_parameters) or
        (n_parameters,); equal bounds fix a parameter. Returned are optima with misfits and the
        numbers of linearisations.
        """
        low = np.broadcast_to(self.low[trace] if low is None else low, starts.shape)
        high = np.broadcast_to(self.high[trace] if high is None else high, starts.shape)
        starts = np.clip(starts, low, high)
        if constraint is not None:
            starts = constraint.started(starts)

        def objective(x: Array, fit: IntArray) -> Normal:
            normal = self.normal(x, trace[fit])
            return normal if constraint is None else constraint.added(normal, x, fit)

        if constraint is None:
            return minimize(objective, starts, low, high, tolerance)
        # Fair fits tell basins, into more of which relative damping leads; closer ones go on.
        given = objective, starts, low, high, tolerance, constraint
        if tolerance >= FAIR:
            return minimize(*given, most_steps=_MOST_FAIR_STEPS)
        return minimize(*given, even=True)

    def in_order(self, minima: Minima) -> Minima:
        """Return optima with their branches sorted by relaxation time."""
        order = self._residuals.model.in_order(np.exp(minima.x))
        return replace(minima, x=np.take_along_axis(minima.x, order, axis=1))


FINISHED = 4
"""Number of a trace's best rough fits that are continued to the optimum."""


@dataclass(frozen=True)
class LeastSquaresSettings(Block):
    """Local fits from random points, the method of identifiability analyses, too."""

    candidates: Annotated[int, Field(ge=1, le=1_000_000)]
    """Points drawn, uniformly in the logarithms of the parameters."""
    starts: Annotated[int, Field(ge=1, le=10_000)]
    """Local fits, from the best of them."""


def identify_many(
    problems: Sequence[TraceProblem],
    settings: LeastSquaresSettings,
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress = silent,
    further: Sequence[Array] | None = None,
) -> list[Fit]:
    """Identify samples by local fits from the best of many random points.

    Further starts of each trace are log-parameters, (n_further, n_parameters). `progress` is called
    after every trace. If the model has no response at any of the points, it is a `BiogripError`.
    """
    pairs = zip(problems, rngs, strict=True)
    points = [screened(problem, settings, rng) for problem, rng in pairs]
    starts, before = zip(*points, strict=True)
    if further is not None:
        starts = tuple(map(np.concatenate, zip(starts, further, strict=True)))
    return best_of_starts(problems, starts, before, progress)


def screened(
    problem: TraceProblem, settings: LeastSquaresSettings, rng: np.random.Generator
) -> tuple[Array, HistoryRow]:
    """Return the best random points as starts, and the first row of the history."""
    shape = (settings.candidates, len(problem.low))
    points = rng.uniform(problem.low, problem.high, shape)
    misfit = problem.residuals.misfit(np.exp(points))
    # Equals, in single precision, keep their order.
    order = np.argsort(misfit.astype(np.float32), kind="stable")
    order = order[np.isfinite(misfit[order])]
    points, misfit = points[order], misfit[order]
    if not len(points):
        raise BiogripError(
            "least_squares: the model has no answer anywhere in the search range; "
            "allowed are smaller torques, or the linear model."
        )
    before = np.exp(points[0]), float(misfit[0]), float(np.median(misfit)), settings.candidates
    return points[: settings.starts], before


def best_of_starts(
    problems: Sequence[TraceProblem],
    starts: Sequence[Array],
    before: Sequence[HistoryRow],
    progress: ReportProgress,
) -> list[Fit]:
    """Fit every trace from each of its starts and return the optima of lowest misfit.

    Misfits are compared in single precision and the first of equals wins, so that the
    last bits, which differ between processors, decide nothing. Starts of each trace are
    log-parameters, (n_starts, n_parameters); the first row of its history is what was before.
    """
    answers: dict[int, Fit] = {}
    for group in alike(problems):
        fits, traces = LocalFits([problems[index] for index in group]), np.arange(len(group))
        rough, trace, fine, trace_of_fine = _finished(fits, [starts[index] for index in group])
        winners = np.concatenate([_best(fine, trace_of_fine == in_group, 1) for in_group in traces])
        best = fits.in_order(fine[winners])
        for in_group, index in enumerate(group.tolist()):
            rows = _descents(rough[trace == in_group], before[index])
            finished = _count_responses(fine)[trace_of_fine == in_group].sum()
            misfit, evaluations = float(best.misfit[in_group]), rows[-1][3] + int(finished)
            rows[-1] = np.exp(best.x[in_group]), misfit, misfit, evaluations
            steps, why, converged = (
                len(rows) - 1,
                "all starts fitted",
                bool(best.converged[in_group]),
            )
            given = rows[-1][0], misfit, steps, evaluations, why, History.of(rows), converged
            answers[index] = Fit(*given)
            progress(len(answers) / len(problems))
    return [answers[index] for index in range(len(problems))]


def _finished(
    fits: LocalFits, starts: Sequence[Array]
) -> tuple[Minima, IntArray, Minima, IntArray]:
    """Fit roughly from all starts, then finely from the best; return both with their traces."""
    trace = np.repeat(np.arange(len(starts)), [len(of_trace) for of_trace in starts])
    rough = fits.fitted(np.concatenate(starts), trace, ROUGH)
    # Rough fits show which basins are deepest; only the best are continued to the optimum.
    best = [_best(rough, trace == number, FINISHED) for number in range(len(starts))]
    finalists = np.concatenate(best)
    return rough, trace, fits.fitted(rough.x[finalists], trace[finalists]), trace[finalists]


def _best(minima: Minima, which: BoolArray, count: int) -> IntArray:
    """Return the indices of the best fits among those that `which` marks."""
    chosen = np.flatnonzero(which)
    order = np.argsort(minima.misfit[chosen].astype(np.float32), kind="stable")
    return chosen[order[:count]]


def _descents(minima: Minima, before: HistoryRow) -> list[HistoryRow]:
    """Return the rows of a history: the given first one, and one for each fit."""
    rows, evaluations, best, ordered = [before], before[3], 0, list[float]()
    ranks, responses = minima.misfit.astype(np.float32), _count_responses(minima)
    for fit, misfit in enumerate(minima.misfit.tolist()):
        evaluations += int(responses[fit])
        best = fit if ranks[fit] < ranks[best] else best
        insort(ordered, misfit)
        median = 0.5 * (ordered[fit // 2] + ordered[(fit + 1) // 2])
        rows.append((np.exp(minima.x[best]), float(minima.misfit[best]), median, evaluations))
    return rows


def _count_responses(minima: Minima) -> IntArray:
    """Return how many responses fits have computed: a linearisation is one and its derivatives."""
    return minima.evaluations * (1 + minima.x.shape[1])


def identify_from(problem: TraceProblem, start: Array) -> Fit:
    """Fit a trace from a single start, (n_parameters,) log-parameters."""
    misfit = float(problem.residuals.misfit(np.exp(start)[None])[0])
    row = np.exp(start), misfit, misfit, 1
    return best_of_starts([problem], [start[None]], [row], silent)[0]


def fit_from(problems: Sequence[TraceProblem], starts: Array, *, roughly: bool = False) -> Minima:
    """Fit every trace from one starting point.

    Parameters
    ----------
    problems
        Traces of one model.
    starts
        Log-parameters, (n_parameters,) or (n_traces, n_parameters).
    roughly
        True for fits that are less fine, to compare basins.

    Returns
    -------
    Minima
        Of each trace, with branches sorted by relaxation time.
    """
    starts = np.broadcast_to(starts, (len(problems), len(problems[0].low)))
    groups, minima = alike(problems), list[Minima]()
    for group in groups:
        fits, traces = LocalFits([problems[index] for index in group]), np.arange(len(group))
        minima.append(fits.in_order(fits.fitted(starts[group], traces, FAIR if roughly else FINE)))
    return Minima.joined(minima)[np.argsort(np.concatenate(groups))]
