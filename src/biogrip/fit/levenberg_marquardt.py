"""Levenberg-Marquardt least squares within bounds, for many problems at once [1]_, [2]_.

Every problem has its own damping, adapted as in [4]_, and is removed when it has converged [3]_. A
step stays within the bounds and within a box about its origin: parameters that would leave are
fixed at the edge, and the others are solved for again. No sum runs over problems, nor in an order
that depends on their number: no result depends, to the last bit, on the other problems.

Damping is relative to the diagonal of the information [2]_ or, if it is `even`, the same for all
parameters [1]_. Even, it shortens steps along a curved valley, while well determined parameters
adapt freely; relative, it would hold these, and so be far slower there.

Points are rounded to a grid far finer than the statistical uncertainty. Processors differ in the
last bits of a step, and a descent along a valley would amplify these until decisions differ. On the
grid, every step begins with the same bits on all processors.

References
----------
.. [1] K. Levenberg, Quarterly of Applied Mathematics 2 (1944), 164-168.
.. [2] D. W. Marquardt, SIAM Journal on Applied Mathematics 11 (1963), 431-441.
.. [3] J. J. Moré, in G. A. Watson (ed.), Numerical Analysis, Springer, 1978, 105-116.
.. [4] H. B. Nielsen, Damping parameter in Marquardt's method, report IMM-REP-1999-05, 1999.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray

_FIRST_DAMPING, _LEAST_DAMPING = 1e-2, 1e-9
# In e-folds. Linearised responses are wrong for longer steps, which would waste starts.
_LONGEST_STEP = 3.0
_MOST_ITERATIONS = 1000
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
    most_steps: int = _MOST_ITERATIONS,
    *,
    even: bool = False,
) -> Minima:
    """Minimize the sum of squares of every problem from its start.

    Starts and bounds, (n, n_parameters), are logarithms; equal bounds fix a parameter. A problem
    has converged when the actual and the predicted relative decrease of its sum are below the
    tolerance. Damping is relative to the diagonal of the information or, if it is even, in units of
    the sum of squares.
    """
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


# Singular ones, as of a trace without noise, have no solution: their steps, NaN, are not taken.
@np.errstate(divide="ignore", invalid="ignore")
def _solved(matrix: Array, vector: Array) -> Array:
    """Solve small positive definite systems, each step of elimination for all: for speed."""
    a, b = matrix.transpose(1, 2, 0).copy(), vector.T.copy()
    for row in range(len(b) - 1):
        share = a[row + 1 :, row] / a[row, row]
        a[row + 1 :, row + 1 :] -= share[:, None] * a[row, row + 1 :]
        b[row + 1 :] -= share * b[row]
    for row in range(len(b))[::-1]:
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
