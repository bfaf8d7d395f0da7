"""Bounded multi-start least squares on log-parameters, for many traces at once [1]_.

The fits of traces with the same protocol, sampling times and model, from any number of starts, are
computed as one array (`LocalFits`). Local fits start from the best of many random points. All are
rough; the best few are continued to their optima. No result depends, to the last bit, on the other
fits: no sum runs over them, nor in an order that depends on their number.

Local fits (`minimize`) are by Levenberg and Marquardt [2]_, [3]_. Each has its own damping, adapted
as in [5]_, and is removed when it has converged [4]_. A step stays within the bounds and within a
box about its origin: parameters that would leave are fixed at the edge, and the others are solved
for again.

Damping is relative to the diagonal of the information [3]_ or, if it is `even`, the same for all
parameters [2]_. Even, it shortens steps along a curved valley, while well determined parameters
adapt freely; relative, it would hold these, and so be far slower there.

Points are rounded to a grid far finer than the statistical uncertainty. Processors differ in the
last bits of a step, and a descent along a valley would amplify these until decisions differ. On the
grid, every step begins with the same bits on all processors.

References
----------
.. [1] A. Raue et al., PLoS ONE 8 (2013), e74335: local fits from many starts.
.. [2] K. Levenberg, Quarterly of Applied Mathematics 2 (1944), 164-168.
.. [3] D. W. Marquardt, SIAM Journal on Applied Mathematics 11 (1963), 431-441.
.. [4] J. J. Moré, in G. A. Watson (ed.), Numerical Analysis, Springer, 1978, 105-116.
.. [5] H. B. Nielsen, Damping parameter in Marquardt's method, report IMM-REP-1999-05, 1999.
"""

from bisect import insort
from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Protocol, Self

import numpy as np
from pydantic import Field

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.errors import BiogripError
from biogrip.fit.problem import Fit, History, HistoryRow, ReportProgress, TraceProblem, silent
from biogrip.keys import Block

_FIRST_DAMPING, _LEAST_DAMPING = 1e-2, 1e-9
# In e-folds. Linearised responses are wrong for longer steps, which would waste starts.
_LONGEST_STEP = 3.0
_MOST_ITERATIONS = 1000
# Most steps of fair fits with a quantity held.
_MOST_FAIR_STEPS = 40
_STANDSTILL = 1e-8
_LEAST_INFORMATION = 1e-300
# Ratios of actual to predicted decrease are rounded to multiples of one over this.
_RATIOS = 256
# Grid spacing, in standard deviations of a parameter with all others known; and its maximum.
_SPACING, _WIDEST = 1e-3, 2.0**-10


class Rows:
    """Base of dataclasses whose fields are arrays with a row for each of n problems."""

    @property
    def parts(self) -> tuple[Any, ...]:
        """All fields, in order."""
        return tuple(vars(self).values())

    def __getitem__(self, which: BoolArray | IntArray) -> Self:
        """Return the rows of some problems."""
        return type(self)(*(part[which] for part in self.parts))

    @classmethod
    def joined(cls, some: Sequence[Self]) -> Self:
        """Concatenate the rows of several objects."""
        return cls(*map(np.concatenate, zip(*(rows.parts for rows in some), strict=True)))


@dataclass
class Normal(Rows):
    """Normal equations of n problems."""

    square_sum: Array
    """Sum of squares that is minimized, (n,)."""
    gradient: Array
    """Half its gradient, (n, n_parameters)."""
    information: Array
    """Half its Hessian, (n, n_parameters, n_parameters), by Gauss-Newton."""
    misfit: Array
    """RMS misfit to the trace, (n,)."""


Objective = Callable[[Array, IntArray], Normal]
"""Function of points, (n, n_parameters), and problem indices, (n,): their normal equations."""


class Constraint(Protocol):
    """A constraint on the parameters of each problem, kept exactly by eliminating one of them."""

    def started(self, x: Array) -> Array:
        """Return points near the given ones, one a problem, that fulfil the constraint."""

    def added(self, normal: Normal, x: Array, problem: IntArray) -> Normal:
        """Return the normal equations with the residuals of the constraint, if it has any."""

    def eliminated(self, normal: Normal, x: Array, problem: IntArray) -> tuple[Normal, BoolArray]:
        """Eliminate one parameter; return reduced equations and its mask, (n, n_parameters)."""

    def restored(self, x: Array, problem: IntArray, eliminated: BoolArray) -> Array:
        """Move points, (n, n_parameters), onto the constraint; NaN where bounds forbid that."""


@dataclass
class Minima(Rows):
    """Results of minimizing n problems."""

    x: Array
    """Final points, (n, n_parameters)."""
    misfit: Array
    """RMS misfits there, (n,)."""
    evaluations: IntArray
    """Number of linearisations of each problem, (n,)."""
    converged: BoolArray
    """True if the minimization ended before the limit of steps, (n,)."""


@dataclass
class _State(Rows):
    problem: IntArray
    x: Array
    low: Array
    high: Array
    normal: Normal
    damping: Array
    growth: Array


def minimize(
    objective: Objective,
    starts: Array,
    low: Array,
    high: Array,
    tolerance: float,
    constraint: Constraint | None = None,
) -> Minima:
    """Minimize the sum of squares of every problem from its start.

    Starts and bounds, (n, n_parameters), are logarithms; equal bounds fix a parameter. A problem
    has converged when the actual and the predicted relative decrease of its sum are below the
    tolerance. With a constraint, fair fits tell basins, into more of which damping leads that is
    relative to the diagonal of the information; closer ones go on with even damping, in units of
    the sum of squares.
    """
    even = constraint is not None and tolerance < FAIR
    most_steps = _MOST_ITERATIONS if constraint is None or even else _MOST_FAIR_STEPS
    everyone, count = np.arange(len(starts)), len(starts)
    never = np.full(count, np.inf), np.ones(count, dtype=np.int64), np.zeros(count, dtype=bool)
    minima = Minima(starts.copy(), *never)
    normal, growth = objective(starts, everyone), np.full(count, 2.0)
    state = _State(everyone, starts, low, high, normal, np.full(count, _FIRST_DAMPING), growth)
    for _ in range(most_steps):
        minima.evaluations[state.problem] += 1
        done = _advance(state, objective, constraint, tolerance, even=even)
        if np.any(done):
            minima.converged[state.problem[done]] = True
            _leave(state[done], minima)
            state = state[~done]
        if not len(state.problem):
            break
    _leave(state, minima)
    return minima


def _advance(
    state: _State,
    objective: Objective,
    constraint: Constraint | None,
    tolerance: float,
    *,
    even: bool,
) -> BoolArray:
    """Try a step in every problem, keep those that decrease it, return which have converged."""
    x, problem, normal = state.x, state.problem, state.normal
    reduced, basic = normal, np.zeros(x.shape, dtype=bool)
    if constraint is not None:
        reduced, basic = constraint.eliminated(normal, x, problem)
    below = np.where(basic, 0.0, np.maximum(state.low - x, -_LONGEST_STEP))
    above = np.where(basic, 0.0, np.minimum(state.high - x, _LONGEST_STEP))
    damping = state.damping[:, None]
    if even:
        damping = damping / _size(reduced.information)
    step = _bounded_step(reduced, damping, below, above)
    # Valleys are straight in the logarithms or, where a sum is determined, in the parameters.
    straight = np.where(state.growth[:, None] > 2, np.log1p(np.maximum(step, -0.9)), step)
    tried, possible = _on_grid(x + straight, state), np.ones(len(x), dtype=bool)
    if constraint is not None:
        tried = constraint.restored(tried, problem, basic)
        possible = np.isfinite(tried[:, 0])
        tried = np.clip(np.where(possible[:, None], tried, x), state.low, state.high)
    ahead = objective(tried, problem)
    predicted = -np.sum(step * (2 * reduced.gradient + _times(reduced.information, step)), axis=1)
    gained = np.where(possible, normal.square_sum - ahead.square_sum, -np.inf)
    small = tolerance * normal.square_sum
    done = (np.abs(gained) <= small) & (predicted <= small)
    done |= (np.max(np.abs(step), axis=1) <= _STANDSTILL) | possible & np.all(tried == x, axis=1)
    _damp(state, gained, predicted)
    better = gained > 0
    state.x = np.where(better[:, None], tried, x)
    pairs = zip(ahead.parts, normal.parts, strict=True)
    chosen = (np.where(better.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs)
    state.normal = Normal(*chosen)
    return done


def _on_grid(x: Array, state: _State) -> Array:
    """Round points to the grid of each problem, except parameters at a bound."""
    # A power of two, so that points of a coarser grid are points of a finer one.
    spacing = np.ldexp(1.0, np.frexp(_SPACING / np.sqrt(_size(state.normal.information)))[1])
    spacing = np.minimum(spacing, _WIDEST)
    inside = (x > state.low) & (x < state.high)
    rounded = np.where(inside, np.rint(x / spacing) * spacing, x)
    return np.minimum(np.maximum(rounded, state.low), state.high)


def _size(information: Array) -> Array:
    """Return the diagonals of matrices, (n, n_parameters), never zero."""
    # A parameter without any effect must not divide by zero.
    return np.abs(np.diagonal(information, axis1=1, axis2=2)) + _LEAST_INFORMATION


def _bounded_step(normal: Normal, damping: Array, below: Array, above: Array) -> Array:
    """Compute damped Gauss-Newton steps within a box, (n, n_parameters).

    The damping, (n, 1) or (n, n_parameters), is relative to the diagonal of the information. The
    box has the smallest and largest change of each parameter, (n, n_parameters), zero between them.
    """
    gradient, information = normal.gradient, normal.information
    fixed = ((below >= 0) & (gradient > 0)) | ((above <= 0) & (gradient < 0))
    unbounded = _free_step(gradient, information, damping, fixed)
    step = np.clip(unbounded, below, above)
    outside = step != unbounded
    again = np.flatnonzero(np.any(outside, axis=1))
    if len(again):
        information = information[again]
        fixed = fixed[again] | outside[again]
        given = np.where(fixed, step[again], 0.0)
        pull = gradient[again] + _times(information, given)
        rest = _free_step(pull, information, damping[again], fixed)
        # Parameters that leave the box now are clipped.
        step[again] = np.clip(given + rest, below[again], above[again])
    return step


def _free_step(gradient: Array, information: Array, damping: Array, fixed: BoolArray) -> Array:
    """Compute the damped steps of parameters that are not fixed."""
    diagonal = np.arange(gradient.shape[1])
    # Marquardt's scaling.
    scale = np.where(fixed, 0.0, 1 / np.sqrt(_size(information)))
    matrix = information * (scale[:, :, None] * scale[:, None, :])
    matrix[:, diagonal, diagonal] = np.where(fixed, 1.0, 1.0 + damping)
    return -scale * _solved(matrix, scale * gradient)


@np.errstate(divide="ignore", invalid="ignore")
def _solved(matrix: Array, vector: Array) -> Array:
    """Solve small positive definite systems, each step of elimination for all.

    One that rounding makes singular, as of a trace without noise, has no finite step, which is not
    taken; NumPy would raise an error for all.
    """
    a, b = matrix.transpose(1, 2, 0).copy(), vector.T.copy()
    size = len(b)
    for row in range(size - 1):
        share = a[row + 1 :, row] / a[row, row]
        a[row + 1 :, row + 1 :] -= share[:, None] * a[row, row + 1 :]
        b[row + 1 :] -= share * b[row]
    for row in range(size)[::-1]:
        b[row] /= a[row, row]
        b[:row] -= a[:row, row] * b[row]
    return b.T


def _damp(state: _State, gained: Array, predicted: Array) -> None:
    """Adapt the damping to the ratio of actual to predicted decrease (Nielsen 1999)."""
    hopeful = predicted > 0
    ratio = np.where(hopeful, gained / np.where(hopeful, predicted, 1.0), -1.0)
    # The last bits are a large share of a tiny decrease.
    ratio = np.rint(np.minimum(np.maximum(ratio, -1.0), 2.0) * _RATIOS) / _RATIOS
    better = ratio > 0
    less = np.maximum(1 / 3, 1 - (2 * np.where(better, ratio, 0.5) - 1) ** 3)
    state.damping = np.where(
        better, np.maximum(state.damping * less, _LEAST_DAMPING), state.damping * state.growth
    )
    state.growth = np.where(better, 2.0, 2 * state.growth)


def _leave(state: _State, minima: Minima) -> None:
    minima.x[state.problem] = state.x
    minima.misfit[state.problem] = state.normal.misfit


def _times(matrices: Array, vectors: Array) -> Array:
    """Multiply the matrix and the vector of each problem."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


PRIOR_WIDTH = 100.0
"""Standard deviation, in e-folds, of the Gaussian prior about the middle of each range. It changes
estimates by the square of (standard deviation / 100 e-folds), and places a parameter that the
trace does not inform, which rounding would place."""

ROUGH, FAIR, FINE = 1e-5, 1e-6, 1e-9
"""Relative decrease of the sum of squares below which a fit has converged, to tell basins, to give
chi^2 of some thousand readings to 0.01, and the optimum: far above rounding errors, and where the
grid of `minimize`, a thousandth of a standard deviation, ends most fits."""


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

        Log-parameters are (n, n_parameters), each for a trace. They are infinite where there is no
        response.
        """
        rows = self._residuals.condensed_responses(x)
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

        return minimize(objective, starts, low, high, tolerance, constraint)

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

    Starts of each trace are log-parameters, (n_starts, n_parameters); the first row of its history
    is what was before.
    """
    answers: dict[int, Fit] = {}
    for group in alike(problems):
        fits, traces = LocalFits([problems[index] for index in group]), range(len(group))
        of_group = [starts[index] for index in group]
        trace = np.repeat(traces, [*map(len, of_group)])
        rough = fits.fitted(np.concatenate(of_group), trace, ROUGH)
        # Rough fits show which basins are deepest; only the best are continued to the optimum.
        descents = [rough[trace == in_group] for in_group in traces]
        finalists = [_lowest(minima, FINISHED) for minima in descents]
        trace = np.repeat(traces, [len(minima.misfit) for minima in finalists])
        fine = fits.fitted(Minima.joined(finalists).x, trace)
        for in_group, index in enumerate(group.tolist()):
            ends, rows = fine[trace == in_group], _descents(descents[in_group], before[index])
            best = fits.in_order(_lowest(ends, 1))
            misfit = float(best.misfit[0])
            evaluations = rows[-1][3] + int(_count_responses(ends).sum())
            rows[-1] = np.exp(best.x[0]), misfit, misfit, evaluations
            given = rows[-1][0], misfit, len(rows) - 1, evaluations, "all starts fitted"
            answers[index] = Fit(*given, History.of(rows), bool(best.converged[0]))
            progress(len(answers) / len(problems))
    return [answers[index] for index in range(len(problems))]


def _lowest(minima: Minima, count: int) -> Minima:
    """Return the best fits, in single precision, the first of equals first.

    So the last bits, which differ between processors, decide nothing.
    """
    return minima[np.argsort(minima.misfit.astype(np.float32), kind="stable")[:count]]


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


def refit(fit: Fit, problem: TraceProblem, start: Array) -> Fit:
    """Return a copy of a fit with the optimum of a local fit from log-parameters."""
    minima = fit_from([problem], start)
    misfit, converged = float(minima.misfit[0]), bool(minima.converged[0])
    return replace(fit, parameters=np.exp(minima.x[0]), misfit=misfit, converged=converged)


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
