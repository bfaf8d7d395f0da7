"""Local fits of the nonlinear model at the cost of fits of the linear model.

Nonlinear minus linear rotation, the correction, is small and smooth, but takes a hundred
times as long to compute as the linear rotation. So the correction is expanded to first
order in the log-parameters about the start of a fit, which then needs linear responses
only. The correction is expanded anew about the end of the fit, until the sum of squares
there equals the predicted one, to the fit's own tolerance. The result is an optimum of
the nonlinear model: neglected terms, of second order in the last step, lie below the
tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.levenberg_marquardt import Constraint, Minima, Normal, Rows, minimize

# Most fits need two or three.
_MOST_ROUNDS = 12
# E-folds; beyond this distance the correction is kept constant.
_FAR = 1.0

Correction = Callable[[Array], Array]
"""Function from log-parameters, (n, n_parameters), to rows (n, 1 + n_parameters, n_rows)."""

Objective = Callable[[Array, IntArray, Array], Normal]
"""Function of points, problem indices and rows of the correction: their normal equations."""


@dataclass
class Expansion(Rows):
    """First-order Taylor expansion of the correction about a point of each problem."""

    about: Array
    """Log-parameters, (n, n_parameters)."""
    rows: Array
    """Correction and its derivatives there, (n, 1 + n_parameters, n_rows)."""

    def at(self, x: Array, problem: IntArray) -> Array:
        """Return correction and derivatives at points, (n, n_parameters), of some problems."""
        away = x - self.about[problem]
        near = np.abs(away) < _FAR
        rows = self.rows[problem]
        moved = (np.clip(away, -_FAR, _FAR)[:, None] @ rows[:, 1:])[:, 0]
        rows[:, 0] += moved
        rows[:, 1:] *= near[:, :, None]
        return rows


@dataclass
class _Some:
    """The constraint of a subset of the problems."""

    own_constraint: Constraint
    which: IntArray

    def eliminated(self, normal: Normal, x: Array, problem: IntArray) -> tuple[Normal, BoolArray]:
        return self.own_constraint.eliminated(normal, x, self.which[problem])

    def restored(self, x: Array, problem: IntArray, eliminated: BoolArray) -> Array:
        return self.own_constraint.restored(x, self.which[problem], eliminated)


def minimize_with_refreshes(
    objective: Objective,
    correction: Correction,
    starts: Array,
    low: Array,
    high: Array,
    tolerance: float,
    constraint: Constraint | None = None,
) -> Minima:
    """Minimize as `minimize` does, with the correction expanded about a few points only.

    The other arguments are those of `minimize`.
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

        own_constraint = None if constraint is None else _Some(constraint, left)
        x[left] = minimize(expanded, x[left], low[left], high[left], tolerance, own_constraint).x
        foreseen[left] = expanded(x[left], np.arange(len(left))).square_sum
    return best
