"""Local fits by SciPy and lmfit, each set up as its documentation shows.

All see the residuals that our own fits see, condensed to some fifty rows in units of
the noise, with exact derivatives by the log-parameters, and the prior, as in `Objective`: what
has been computed at a point is kept there for them.
"""

import lmfit
import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.fit.least_squares import FINE, FINISHED, PRIOR_WIDTH, ROUGH
from biogrip.fit.problem import TraceProblem


class Objective:
    """Rows of the residuals in units of the noise, and of the prior, for one point at a time."""

    def __init__(self, problem: TraceProblem) -> None:
        self.low, self.high = problem.low, problem.high
        self._residuals = problem.residuals
        self._middle = 0.5 * (problem.low + problem.high)
        self._prior = np.eye(len(self._middle)) / PRIOR_WIDTH
        self._last: tuple[Array, Array, Array, float] | None = None

    def rows(self, x: Array) -> Array:
        """Rows, (n_rows,), at log-parameters (n_parameters,)."""
        return self._at(x)[1]

    def jacobian(self, x: Array) -> Array:
        """Their Jacobian, (n_rows, n_parameters)."""
        return self._at(x)[2]

    def misfit(self, x: Array) -> float:
        """RMS misfit."""
        return self._at(x)[3]

    def _at(self, x: Array) -> tuple[Array, Array, Array, float]:
        """All of it; the last is kept, for rows and Jacobian are asked for in turn."""
        if self._last is None or not np.array_equal(self._last[0], x):
            found = self._residuals.condensed_responses(x[None])[0]
            found[0] -= self._residuals.trace.rows
            misfit = float(np.linalg.norm(found[0])) / np.sqrt(self._residuals.samples)
            found /= self._residuals.noise_scale
            rows = np.append(found[0], (x - self._middle) / PRIOR_WIDTH)
            self._last = x.copy(), rows, np.concatenate((found[1:].T, self._prior)), misfit
        return self._last


def by_scipy(problem: TraceProblem, starts: Array) -> Array:
    """Fit by SciPy's bounded trust region from every start; log-parameters of the best."""
    objective = Objective(problem)
    bounds = objective.low, objective.high
    found = [least_squares(objective.rows, start, objective.jacobian, bounds) for start in starts]
    best: Array = min(found, key=lambda fit: fit.cost).x
    return best


def by_scipy_in_two_turns(problem: TraceProblem, starts: Array) -> Array:
    """Fit by the same roughly from every start, and only the best of these to the end."""
    objective = Objective(problem)
    rough = [_local_fit(objective, start, ROUGH) for start in starts]
    rough.sort(key=objective.misfit)
    fine = [_local_fit(objective, x, FINE) for x in rough[:FINISHED]]
    return min(fine, key=objective.misfit)


def _local_fit(objective: Objective, start: Array, tolerance: float) -> Array:
    inside = 1e-9 * (objective.high - objective.low)
    found: Array = least_squares(
        objective.rows,
        np.clip(start, objective.low + inside, objective.high - inside),
        objective.jacobian,
        (objective.low, objective.high),
        ftol=tolerance,
        xtol=FINE,
        gtol=FINE,
    ).x
    return found


def by_lmfit(problem: TraceProblem, starts: Array) -> Array:
    """Fit by lmfit's Levenberg-Marquardt from every start; log-parameters of the best."""
    objective = Objective(problem)

    def values_of(tried: lmfit.Parameters) -> Array:
        return np.array([parameter.value for parameter in tried.values()])

    found = []
    for start in starts:
        ends = zip(start, objective.low, objective.high, strict=True)
        given = lmfit.create_params(
            **{
                f"x{i}": {"value": x, "min": low, "max": high}
                for i, (x, low, high) in enumerate(ends)
            }
        )
        minimizer = lmfit.Minimizer(
            lambda tried: objective.rows(values_of(tried)),
            given,
            Dfun=lambda tried: objective.jacobian(values_of(tried)),
        )
        found.append(minimizer.minimize())
    return values_of(min(found, key=lambda fit: fit.chisqr).params)
