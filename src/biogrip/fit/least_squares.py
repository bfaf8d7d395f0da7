"""Bounded multi-start least squares on log-parameters, for many traces at once [1]_.

The fits of traces with the same protocol, sampling times and model, from any number of starts, are
computed as one array (`LocalFits`). Local fits start from the best of many random points. All are
rough; the best few are continued to their optima, and the best of these is refined by Newton steps
to its last digits (`refine_optima`). No result depends, to the last bit, on the other fits.

References
----------
.. [1] A. Raue et al., PLoS ONE 8 (2013), e74335: local fits from many starts.
.. [2] J. Nocedal and S. J. Wright, Numerical Optimization, Springer, 2006, section 3.4.
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
from biogrip.fit.levenberg_marquardt import Constraint, Minima, Normal, bounded_step, minimize
from biogrip.fit.problem import Fit, History, Progress, Row, TraceProblem, silent
from biogrip.keys import Block

PRIOR_WIDTH = 100.0
"""Standard deviation, in e-folds, of the Gaussian prior about the middle of each range. It changes
estimates by the square of (standard deviation / 100 e-folds), and places a parameter that the
trace does not inform, which rounding would place."""

ROUGH, FAIR, FINE = 1e-5, 1e-6, 1e-8
"""Relative decrease of the sum of squares below which a fit has converged, to tell basins, to give
chi^2 of some thousand readings to 0.01, and the optimum: far above rounding errors."""

# Step of the differences of exact first derivatives that give second derivatives of residuals.
_APART = 1e-4
# Most steps of fair fits with a quantity held.
_FEW_STEPS = 40
# Most numbers in the rows that are formed at once.
_AT_ONCE = 300_000


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

    def normal(self, x: Array, trace: IntArray, *, curved: bool = False) -> Normal:
        """Return the normal equations of the residuals, in units of the noise, and the prior.

        Log-parameters are (n, n_parameters), each for a trace. If `curved`, the full Hessian stands
        in place of its Gauss-Newton part: second derivatives are differences of exact slopes, whose
        error vanishes with the residuals.
        """
        numbers = self._traces.shape[1] * (1 + x.shape[1]) * (2 * x.shape[1] if curved else 1)
        normals = []
        for some in parts(max(len(x), 1), max(1, _AT_ONCE // numbers)):
            rows = self._residuals.condensed_responses(x[some])
            normals.append(self._normal_of(rows, x[some], trace[some]))
            if curved:
                normals[-1].information += self._second(rows[:, 0], x[some], trace[some])
        return Normal.joined(normals) if len(normals) > 1 else normals[0]

    def _second(self, residual: Array, x: Array, trace: IntArray) -> Array:
        """Return residuals times their second derivatives, in units of the noise."""
        count, parameters = x.shape
        both_ways = _APART * np.concatenate((np.eye(parameters), -np.eye(parameters)))
        around = (x[:, None] + both_ways).reshape(-1, parameters)
        slopes = self._residuals.condensed_responses(around)[:, 1:]
        ahead, behind = slopes.reshape(count, 2, parameters * parameters, -1).swapaxes(0, 1)
        # One product per fit: the order of its sums does not depend on the number of fits.
        second = ((ahead - behind) @ residual[:, :, None])[:, :, 0] / (2 * _APART)
        second = second.reshape(count, parameters, parameters)
        second /= (self._noise_sd[trace] ** 2)[:, None, None]
        return 0.5 * (second + second.swapaxes(1, 2))

    def on_all_samples(self, x: Array, trace: IntArray) -> Normal:
        """Return sums of squares and gradients from all readings, without the information."""
        traces = [self.problems[own].residuals for own in trace.tolist()]
        gradients, misfit = self._residuals.gradients(x, traces)
        noise_sd = self._noise_sd[trace]
        away = (x - self._middle[trace]) / PRIOR_WIDTH
        square_sum = self._residuals.samples * (misfit / noise_sd) ** 2
        return Normal(
            np.where(np.isnan(misfit), np.inf, square_sum + np.sum(away**2, axis=1)),
            gradients / noise_sd[:, None] ** 2 + away / PRIOR_WIDTH,
            np.empty((*x.shape, 0)),
            misfit,
        )

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
        (n_parameters,); equal bounds fix a parameter.
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
            return minimize(*given, most_steps=_FEW_STEPS)
        return minimize(*given, even=True)


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
    progress: Progress = silent,
    further: Sequence[Array] | None = None,
    *,
    to_last_digits: bool = True,
) -> list[Fit]:
    """Identify samples by local fits from the best of many random points.

    Further starts of each trace are log-parameters, (n_further, n_parameters). `progress` is called
    after every trace. If the model has no response at any of the points, it is a `BiogripError`.
    Misfits have nine digits unless optima are refined `to_last_digits`.
    """
    pairs = zip(problems, rngs, strict=True)
    points = [screened(problem, settings, rng) for problem, rng in pairs]
    starts, before = zip(*points, strict=True)
    if further is not None:
        starts = tuple(map(np.concatenate, zip(starts, further, strict=True)))
    return best_of_starts(problems, starts, before, progress, to_last_digits=to_last_digits)


def screened(
    problem: TraceProblem, settings: LeastSquaresSettings, rng: np.random.Generator
) -> tuple[Array, Row]:
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
    before: Sequence[Row],
    progress: Progress,
    *,
    to_last_digits: bool = True,
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
        winners = np.concatenate([_best(fine, trace_of_fine == own, 1) for own in traces])
        best = refine_optima(fits, fine[winners], traces, to_last_digits=to_last_digits)
        for own, index in enumerate(group.tolist()):
            rows = _descents(rough[trace == own], before[index])
            # Newton's steps are not counted: the last bits of a processor decide their number.
            finished = _responses(fine)[trace_of_fine == own].sum()
            misfit, evaluations = float(best.misfit[own]), rows[-1][3] + int(finished)
            rows[-1] = np.exp(best.x[own]), misfit, misfit, evaluations
            progress(evaluations, misfit)
            steps, why, converged = len(rows) - 1, "all starts fitted", bool(best.converged[own])
            given = rows[-1][0], misfit, steps, evaluations, why, History.of(rows), converged
            answers[index] = Fit(*given)
    return [answers[index] for index in range(len(problems))]


def _finished(
    fits: LocalFits, starts: Sequence[Array]
) -> tuple[Minima, IntArray, Minima, IntArray]:
    """Fit roughly from all starts, then finely from the best; return both with their traces."""
    trace = np.repeat(np.arange(len(starts)), [len(own_starts) for own_starts in starts])
    rough = fits.fitted(np.concatenate(starts), trace, ROUGH)
    # Rough fits show which basins are deepest; only the best are continued to the optimum.
    best = [_best(rough, trace == own, FINISHED) for own in range(len(starts))]
    finalists = np.concatenate(best)
    return rough, trace, fits.fitted(rough.x[finalists], trace[finalists]), trace[finalists]


def _best(found: Minima, which: BoolArray, count: int) -> IntArray:
    """Return the indices of the best fits among those that `which` marks."""
    chosen = np.flatnonzero(which)
    order = np.argsort(found.misfit[chosen].astype(np.float32), kind="stable")
    return chosen[order[:count]]


def _descents(found: Minima, before: Row) -> list[Row]:
    """Return the rows of a history: the given first one, and one for each fit."""
    rows, evaluations, best, ordered = [before], before[3], 0, list[float]()
    ranks, responses = found.misfit.astype(np.float32), _responses(found)
    for fit, misfit in enumerate(found.misfit.tolist()):
        evaluations += int(responses[fit])
        best = fit if ranks[fit] < ranks[best] else best
        insort(ordered, misfit)
        median = 0.5 * (ordered[fit // 2] + ordered[(fit + 1) // 2])
        rows.append((np.exp(found.x[best]), float(found.misfit[best]), median, evaluations))
    return rows


def _responses(found: Minima) -> IntArray:
    """Return how many responses fits have computed: a linearisation is one and its derivatives."""
    return found.evaluations * (1 + found.x.shape[1])


def identify_from(problem: TraceProblem, start: Array) -> Fit:
    """Fit a trace from a single start, (n_parameters,) log-parameters."""
    misfit = float(problem.residuals.misfit(np.exp(start)[None])[0])
    row = np.exp(start), misfit, misfit, 1
    return best_of_starts([problem], [start[None]], [row], silent)[0]


def fit_from(problems: Sequence[TraceProblem], starts: Array, *, roughly: bool = False) -> Minima:
    """Fit every trace from one starting point, and refine the optima by Newton steps.

    Starts are log-parameters, (n_parameters,) or (n_traces, n_parameters). Rough fits, to compare
    basins, are less fine and without Newton steps.
    """
    starts = np.broadcast_to(starts, (len(problems), len(problems[0].low)))
    groups, found = alike(problems), list[Minima]()
    for group in groups:
        fits, traces = LocalFits([problems[index] for index in group]), np.arange(len(group))
        minima = fits.fitted(starts[group], traces, FAIR if roughly else FINE)
        found.append(minima if roughly else refine_optima(fits, minima, traces))
    return Minima.joined(found)[np.argsort(np.concatenate(groups))]


# Tolerance and initial damping of the steps that approach a minimum along a curved valley.
_CLOSE, _DAMPING = 1e-10, 1e-6
_MOST_STEPS = 60
# Least damping after a rejected step, and the factor by which damping then changes.
_LITTLE, _MORE = 1e-9, 10.0
# Damping with which a step is short.
_SHORT = 1.0
# E-folds; shorter steps are rounding, and every machine decides alike whether a step is shorter.
_STILL = 1e-9
# Steps longer than the first, in e-folds, end on a grid of the second; or of the third times what
# is about the standard deviation of a parameter with all others known, if that is finer.
_FAR, _SPACING, _OF_SD = 1e-5, 2.0**-24, 2.0**-16
# Predicted decrease of a step, over the mean square that the fit leaves: a smaller one than the
# first changes no digit that is written; what ends with less than the second has converged as far
# as data can tell, as limits are at about 4.
_NOTHING, _UNTOLD = 1e-8, 1e-3
# E-folds; a converged fit is nearer to its optimum.
_LONGEST_STEP = 1.0
# Least curvature of a direction, relative to single parameters; and of a single parameter.
_FLAT, _SMALLEST = 1e-12, 1e-150
# Accuracy of a misfit, relative to the largest rotation.
_ROUNDING = 1e-15


def refine_optima(
    fits: LocalFits, found: Minima, trace: IntArray, *, to_last_digits: bool = True
) -> Minima:
    """Refine optima by Newton steps until they are stationary to the last digits [2]_.

    Descents compare sums of squares, and so find an optimum to half the digits; its vanishing
    gradient locates it to all of them. For an element too weak to be seen, second derivatives of
    the residuals decide how the gradient changes: Gauss-Newton steps need not converge. The first
    steps are damped, and compared on condensed rows: they give misfits to nine digits. Only if
    wanted `to_last_digits`, others follow: each is compared, on all readings, with the point before
    it, and kept only if it fits no worse.

    Found are optima, fitted with the finest tolerance, each to the trace of an index, (n,).
    Returned are optima with misfits, none above that of `found`, and the evaluations of the
    refinement; branches sorted by relaxation time. An optimum has converged if its next step would
    change the sum of squares by next to nothing of what the fit leaves of a reading.
    """

    def convex(x: Array, fit: IntArray) -> Normal:
        return _convex(fits, x, trace[fit])

    low, high = fits.low[trace], fits.high[trace]
    closer = minimize(convex, found.x, low, high, _CLOSE, None, _DAMPING, _MOST_STEPS)
    model = fits.problems[0].residuals.model
    evaluations = closer.evaluations * (1 + 2 * found.x.shape[1])

    def in_order(x: Array) -> Array:
        return np.take_along_axis(x, model.in_order(np.exp(x)), axis=1)

    if not to_last_digits:
        return replace(closer, x=in_order(closer.x), evaluations=evaluations)
    here, moving = fits.on_all_samples(found.x, trace), np.arange(len(found.x))
    x, left, damping = found.x.copy(), np.full(len(moving), np.inf), np.zeros(len(moving))
    residuals = [fits.problems[own].residuals for own in trace.tolist()]
    sizes = [(each.trace.scatter, each.peak, each.samples) for each in residuals]
    scatter, peak, samples = np.array(sizes).T
    left_of_one = (here.misfit / scatter) ** 2
    # Rounding errors of sums of squares.
    error = _ROUNDING * peak
    rounding = samples * error * (2 * here.misfit + error) / scatter**2

    def move(which: IntArray, ahead: Array) -> BoolArray:
        """Move fits to those points that are no worse on all readings; return their mask."""
        there = fits.on_all_samples(ahead, trace[which])
        kept = there.square_sum <= here.square_sum[which] + rounding[which]
        x[which[kept]] = ahead[kept]
        for part, new in zip(here.parts, there.parts, strict=True):
            part[which[kept]] = new[kept]
        return kept

    move(moving, closer.x)
    for _ in range(_MOST_STEPS):
        if not len(moving):
            break
        normal = convex(x[moving], moving)
        normal.gradient = here.gradient[moving]
        below = np.maximum(low[moving] - x[moving], -_LONGEST_STEP)
        above = np.minimum(high[moving] - x[moving], _LONGEST_STEP)
        damped = damping[moving, None]
        plain = bounded_step(normal, np.zeros_like(damped), below, above)
        left[moving] = -np.sum(plain * normal.gradient, axis=1)
        converged = left <= np.maximum(_NOTHING * left_of_one, rounding)
        step = bounded_step(normal, damped, below, above)
        step = np.where(damped > 0, np.log1p(np.maximum(step, -0.9)), step)
        on = np.max(np.abs(plain), axis=1) >= _STILL
        moving, step, normal = moving[on], step[on], normal[on]
        if not len(moving):
            break
        evaluations[moving] += 2 + 2 * x.shape[1]
        kept = move(moving, _on_grid(x[moving] + step, step, normal, low[moving], high[moving]))
        more, less = _MORE * damping[moving], damping[moving] / _MORE
        less[less < _LITTLE] = 0.0
        damping[moving] = np.where(kept, less, np.maximum(more, _LITTLE))
        # A converged fit whose short step is rejected, too, is off its optimum by rounding only.
        moving = moving[kept | ~converged[moving] | (damping[moving] < _SHORT)]
    converged = left <= np.maximum(_UNTOLD * left_of_one, rounding)
    return Minima(in_order(x), here.misfit, evaluations, converged)


def _on_grid(x: Array, step: Array, normal: Normal, low: Array, high: Array) -> Array:
    """Round the ends of long steps to a grid, for the reason given in `levenberg_marquardt`.

    Parameters at a bound stay there: off it, their gradient would outweigh what a step gains.
    """
    size = np.abs(np.diagonal(normal.information, axis1=1, axis2=2))
    sd = np.ldexp(1.0, -(np.frexp(size)[1] // 2))
    spacing = np.minimum(_SPACING, _OF_SD * sd)
    far = np.max(np.abs(step), axis=1, keepdims=True) > _FAR
    rounded = far & (x > low) & (x < high)
    return np.clip(np.where(rounded, np.rint(x / spacing) * spacing, x), low, high)


def _convex(fits: LocalFits, x: Array, trace: IntArray) -> Normal:
    """Return normal equations with the moduli of the Hessian's eigenvalues."""
    normal = fits.normal(x, trace, curved=True)
    # A parameter pushed against a bound does not move, whatever the curvature there.
    at_low, at_high = x <= fits.low[trace], x >= fits.high[trace]
    fixed = at_low & (normal.gradient > 0) | at_high & (normal.gradient < 0)
    free = (~fixed[:, :, None]) & (~fixed[:, None, :])
    second = np.where(free, normal.information, np.eye(x.shape[1]))
    scale = np.sqrt(np.abs(np.diagonal(second, axis1=1, axis2=2))) + _SMALLEST
    both = scale[:, :, None] * scale[:, None, :]
    curvatures, directions = np.linalg.eigh(second / both)
    moduli = np.maximum(np.abs(curvatures), _FLAT)
    convex = directions * moduli[:, None] @ directions.swapaxes(1, 2)
    normal.information = np.where(curvatures[:, :1, None] > _FLAT, second, convex * both)
    return normal
