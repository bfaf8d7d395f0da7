"""Local fits of the nonlinear model at the price of the linear one's.

Nonlinear minus linear rotation is small and smooth, but takes a hundred times as
long as the linear rotation. So it is expanded to first order in the log-parameters
about the point that a fit starts from; with that, the fit is one of the linear
model. About where it ends it is expanded anew, until the sum of squares there is
the one that was foreseen, to the fit's own tolerance. What is returned is then an
optimum of the nonlinear model: what is left out of the expansion, of second order
in the last step, lies below the tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.identify.levenberg_marquardt import Constraint, Minima, Normal, Rows, minimized

# Most fits need two or three.
_MOST_ROUNDS = 12
# E-folds; further away, a straight line says little.
_FAR = 1.0

Correction = Callable[[Array], Array]
"""Of log-parameters (n, n_parameters), the rows (n, 1 + n_parameters, n_rows), see `Residuals`."""

Objective = Callable[[Array, IntArray, Array], Normal]
"""Normal equations at points of the problems with given indices, given rows of the correction."""


@dataclass
class Expansion(Rows):
    """A correction to first order about a point of each problem.

    Parameters
    ----------
    about : (n, n_parameters)
        Log-parameters.
    rows : (n, 1 + n_parameters, n_rows)
        Correction and derivatives there.
    """

    about: Array
    rows: Array

    def at(self, x: Array, problem: IntArray) -> Array:
        """Correction and derivatives at points (n, n_parameters) of some problems."""
        away = x - self.about[problem]
        near = np.abs(away) < _FAR
        rows = self.rows[problem]
        moved = (np.clip(away, -_FAR, _FAR)[:, None] @ rows[:, 1:])[:, 0]
        rows[:, 0] += moved
        rows[:, 1:] *= near[:, :, None]
        return rows


@dataclass
class _Some:
    """What holds some of the problems."""

    held: Constraint
    which: IntArray

    def eliminated(self, normal: Normal, x: Array, problem: IntArray) -> tuple[Normal, BoolArray]:
        return self.held.eliminated(normal, x, self.which[problem])

    def restored(self, x: Array, problem: IntArray, eliminated: BoolArray) -> Array:
        return self.held.restored(x, self.which[problem], eliminated)


def minimized_with_refreshes(
    objective: Objective,
    correction: Correction,
    starts: Array,
    low: Array,
    high: Array,
    tolerance: float,
    constraint: Constraint | None = None,
) -> Minima:
    """Descend as `minimized` does, with a correction expanded about few points on the way.

    Other arguments are as of `minimized`.
    """
    best = Minima.none_yet(starts, evaluations=0)
    lowest, foreseen = np.full(len(starts), np.inf), np.full(len(starts), np.nan)
    x, left = starts.copy(), np.arange(len(starts))
    for _ in range(_MOST_ROUNDS):
        here = x[left]
        expansion = Expansion(here, correction(here))
        found = objective(here, left, expansion.rows.copy())
        best.evaluations[left] += 1 + 2 * starts.shape[1]
        better = found.square_sum < lowest[left]
        lower = left[better]
        best.x[lower], best.misfit_rad[lower] = here[better], found.misfit_rad[better]
        lowest[lower] = found.square_sum[better]
        missed = np.abs(found.square_sum - foreseen[left])
        possible = np.isfinite(found.square_sum)
        on = possible & ~(missed <= tolerance * found.square_sum)
        best.converged[left[~on]] = possible[~on]
        left, expansion = left[on], expansion[on]
        if not len(left):
            break

        def expanded(
            points: Array, problem: IntArray, of: Expansion = expansion, which: IntArray = left
        ) -> Normal:
            return objective(points, which[problem], of.at(points, problem))

        held = None if constraint is None else _Some(constraint, left)
        x[left] = minimized(expanded, x[left], low[left], high[left], tolerance, held).x
        foreseen[left] = expanded(x[left], np.arange(len(left))).square_sum
    return best
