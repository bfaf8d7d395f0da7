"""Least squares within bounds, many problems at once (Levenberg 1944, Marquardt 1963).

Every problem has its own damping, adapted as Nielsen (1999) does, and drops out
when it has converged (Moré 1978). A step stays within the bounds and within a box
about the point it starts from: what would leave is fixed at the edge, and the rest
solved for again. No sum runs over problems, nor in an order that depends on how
many there are: to the last bit, what a problem comes out with does not depend on
which others are solved with it.

Points are rounded to a grid far finer than what the data tell. Processors differ in the
last bits of a step, and a descent along a valley would blow that up until decisions
differ: on the grid, every step begins with the same bits on all of them.

References
----------
.. [1] K. Levenberg, A method for the solution of certain non-linear problems in least squares,
   Quarterly of Applied Mathematics 2 (1944), 164-168.
.. [2] D. W. Marquardt, An algorithm for least-squares estimation of nonlinear parameters,
   Journal of the Society for Industrial and Applied Mathematics 11 (1963), 431-441.
.. [3] J. J. Moré, The Levenberg-Marquardt algorithm: implementation and theory, in G. A. Watson
   (ed.), Numerical Analysis, Lecture Notes in Mathematics 630, Springer, 1978, 105-116.
.. [4] H. B. Nielsen, Damping parameter in Marquardt's method, report IMM-REP-1999-05, Technical
   University of Denmark, 1999.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray

_LEAST_DAMPING = 1e-9
# In e-folds. Linearised, a rotation is a poor guide much further, and starts would be wasted.
_LONGEST_STEP = 3.0
_MOST_STEPS = 300
_STANDSTILL = 1e-8
_SMALLEST = 1e-300
# Ratios of gains are told apart to one in so many.
_RATIOS = 256
# Spacing of the grid, in standard deviations of a parameter with all others known, and at most.
_SPACING, _WIDEST = 1e-3, 2.0**-10


class Rows:
    """Arrays, fields of a dataclass, with a row for each of n problems."""

    @property
    def parts(self) -> tuple[Any, ...]:
        """All of them, in order."""
        return tuple(vars(self).values())

    def __getitem__(self, which: BoolArray | IntArray) -> Self:
        """Return the rows of some problems."""
        return type(self)(*(part[which] for part in self.parts))

    @classmethod
    def joined(cls, some: Sequence[Self]) -> Self:
        """Put the rows of some behind one another."""
        return cls(*map(np.concatenate, zip(*(each.parts for each in some), strict=True)))


@dataclass
class Normal(Rows):
    """Normal equations of n problems.

    Parameters
    ----------
    square_sum : (n,)
        What is minimized, a sum of squares.
    gradient : (n, n_parameters)
        Half its gradient.
    information : (n, n_parameters, n_parameters)
        Half its second derivatives, as far as first derivatives of residuals give them.
    misfit_rad : (n,)
        RMS misfit to the trace.
    """

    square_sum: Array
    gradient: Array
    information: Array
    misfit_rad: Array


Objective = Callable[[Array, IntArray], Normal]
"""Normal equations at points (n, n_parameters) of the problems with given indices, (n,)."""


class Constraint(Protocol):
    """A relation between the parameters of each problem, kept exactly by eliminating one."""

    def eliminated(self, normal: Normal, x: Array, problem: IntArray) -> tuple[Normal, BoolArray]:
        """Normal equations for all parameters but one, and which one it is, (n, n_parameters)."""

    def restored(self, x: Array, problem: IntArray, eliminated: BoolArray) -> Array:
        """Points, (n, n_parameters), with the relation restored; NaN if bounds forbid that."""


@dataclass
class Minima(Rows):
    """Where the problems ended.

    Parameters
    ----------
    x : (n, n_parameters)
        Points.
    misfit_rad : (n,)
        RMS misfits there.
    evaluations : (n,)
        How often each problem was linearised.
    converged : (n,)
        Whether the descent came to an end by itself.
    """

    x: Array
    misfit_rad: Array
    evaluations: IntArray
    converged: BoolArray

    @classmethod
    def none_yet(cls, starts: Array, evaluations: int) -> "Minima":
        """Return what is known of starting points that are not compared with any other yet."""
        count = len(starts)
        misfit_rad, converged = np.full(count, np.inf), np.zeros(count, dtype=bool)
        return cls(starts.copy(), misfit_rad, np.full(count, evaluations), converged)


@dataclass
class _State(Rows):
    problem: IntArray
    x: Array
    low: Array
    high: Array
    normal: Normal
    damping: Array
    growth: Array


def minimized(
    objective: Objective,
    starts: Array,
    low: Array,
    high: Array,
    tolerance: float,
    constraint: Constraint | None = None,
    damping: float = 1e-2,
    most_steps: int = _MOST_STEPS,
) -> Minima:
    """Descend from a starting point in every problem.

    Parameters
    ----------
    objective
        What is minimized.
    starts : (n, n_parameters)
        Within bounds, and fulfilling the constraint; logarithms, for steps are limited in length.
    low, high : (n, n_parameters)
        Bounds; what is equal stays.
    tolerance
        Stop when a step lowers the sum of squares, and was to lower it, by less than this share.
    constraint
        What is to hold on the way.
    damping
        Of the first steps, relative to the diagonal of the information.
    most_steps
        Stop after so many.
    """
    everyone, minima = np.arange(len(starts)), Minima.none_yet(starts, evaluations=1)
    normal, growth = objective(starts, everyone), np.full(len(starts), 2.0)
    dampings = np.full(len(starts), damping)
    state = _State(everyone, starts, low, high, normal, dampings, growth)
    for _ in range(most_steps):
        minima.evaluations[state.problem] += 1
        done = _advance(state, objective, constraint, tolerance)
        if np.any(done):
            minima.converged[state.problem[done]] = True
            _leave(state[done], minima)
            state = state[~done]
        if not len(state.problem):
            break
    _leave(state, minima)
    return minima


def _advance(
    state: _State, objective: Objective, constraint: Constraint | None, tolerance: float
) -> BoolArray:
    """Try a step in every problem, keep it where it leads down, and tell which are done."""
    x, problem, normal = state.x, state.problem, state.normal
    reduced, basic = normal, np.zeros(x.shape, dtype=bool)
    if constraint is not None:
        reduced, basic = constraint.eliminated(normal, x, problem)
    below = np.where(basic, 0.0, np.maximum(state.low - x, -_LONGEST_STEP))
    above = np.where(basic, 0.0, np.minimum(state.high - x, _LONGEST_STEP))
    step = bounded_step(reduced, state.damping, below, above)
    # Valleys are straight in the logarithms or, of sums, in the parameters themselves.
    straight = np.where(state.growth[:, None] > 2, np.log1p(np.maximum(step, -0.9)), step)
    tried, possible = _on_grid(x + straight, state), np.ones(len(x), dtype=bool)
    if constraint is not None:
        tried = constraint.restored(tried, problem, basic)
        possible = np.isfinite(tried[:, 0])
        tried = np.clip(np.where(possible[:, None], tried, x), state.low, state.high)
    found = objective(tried, problem)
    predicted = -np.sum(step * (2 * reduced.gradient + _times(reduced.information, step)), axis=1)
    gained = np.where(possible, normal.square_sum - found.square_sum, -np.inf)
    small = tolerance * normal.square_sum
    done = (np.abs(gained) <= small) & (predicted <= small)
    done |= (np.max(np.abs(step), axis=1) <= _STANDSTILL) | np.all(tried == x, axis=1)
    _damp(state, gained, predicted)
    better = gained > 0
    state.x = np.where(better[:, None], tried, x)
    state.normal = _either(better, found, normal)
    return done


def _on_grid(x: Array, state: _State) -> Array:
    """Round points to the grid of each problem, but for what is at a bound."""
    diagonal = np.arange(x.shape[1])
    size = np.abs(state.normal.information[:, diagonal, diagonal]) + _SMALLEST
    # A power of two, so that points of a finer grid stay where they are.
    spacing = np.ldexp(1.0, np.frexp(_SPACING / np.sqrt(size))[1])
    spacing = np.minimum(spacing, _WIDEST)
    inside = (x > state.low) & (x < state.high)
    rounded = np.where(inside, np.rint(x / spacing) * spacing, x)
    return np.minimum(np.maximum(rounded, state.low), state.high)


def bounded_step(normal: Normal, damping: Array, below: Array, above: Array) -> Array:
    """Damped Gauss-Newton steps, with what would leave a box fixed at its edge.

    Parameters
    ----------
    normal
        Normal equations of n problems.
    damping : (n,)
        Relative to the diagonal of the information; 0 for plain Gauss-Newton.
    below, above : (n, n_parameters)
        How far each parameter may change; neither above nor below zero.

    Returns
    -------
    (n, n_parameters)
    """
    gradient, information = normal.gradient, normal.information
    fixed = ((below >= 0) & (gradient > 0)) | ((above <= 0) & (gradient < 0))
    wanted = _free_step(gradient, information, damping, fixed)
    step = np.clip(wanted, below, above)
    outside = step != wanted
    again = np.flatnonzero(np.any(outside, axis=1))
    if len(again):
        information = information[again]
        fixed = fixed[again] | outside[again]
        given = np.where(fixed, step[again], 0.0)
        pull = gradient[again] + _times(information, given)
        rest = _free_step(pull, information, damping[again], fixed)
        # Whatever leaves the box now is cut off there.
        step[again] = np.clip(given + rest, below[again], above[again])
    return step


def _free_step(gradient: Array, information: Array, damping: Array, fixed: BoolArray) -> Array:
    """Steps of what is not fixed."""
    diagonal = np.arange(gradient.shape[1])
    # Marquardt's scaling; what has no effect at all must not divide by zero.
    size = np.abs(information[:, diagonal, diagonal]) + _SMALLEST
    scale = np.where(fixed, 0.0, 1 / np.sqrt(size))
    matrix = information * (scale[:, :, None] * scale[:, None, :])
    matrix[:, diagonal, diagonal] = np.where(fixed, 1.0, 1.0 + damping[:, None])
    return -scale * _solved(matrix, scale * gradient)


def _solved(matrix: Array, vector: Array) -> Array:
    """Solve positive definite systems, (n, size, size) and (n, size), by elimination.

    For matrices this small it is several times as fast to do each of its steps for all
    systems than all steps for each, as a library does.
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
    """Adapt the damping to how much of what was predicted was gained (Nielsen 1999)."""
    hopeful = predicted > 0
    ratio = np.where(hopeful, gained / np.where(hopeful, predicted, 1.0), -1.0)
    # Of a gain that is next to nothing, last bits are a large share.
    ratio = np.rint(np.minimum(np.maximum(ratio, -1.0), 2.0) * _RATIOS) / _RATIOS
    better = ratio > 0
    less = np.maximum(1 / 3, 1 - (2 * np.where(better, ratio, 0.5) - 1) ** 3)
    state.damping = np.where(
        better, np.maximum(state.damping * less, _LEAST_DAMPING), state.damping * state.growth
    )
    state.growth = np.where(better, 2.0, 2 * state.growth)


def _leave(state: _State, minima: Minima) -> None:
    minima.x[state.problem] = state.x
    minima.misfit_rad[state.problem] = state.normal.misfit_rad


def _either(which: BoolArray, one: Normal, other: Normal) -> Normal:
    pairs = zip(one.parts, other.parts, strict=True)
    chosen = (np.where(which.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs)
    return Normal(*chosen)


def _times(matrices: Array, vectors: Array) -> Array:
    """Product of a matrix and a vector in each problem."""
    return (matrices @ vectors[:, :, None])[:, :, 0]
