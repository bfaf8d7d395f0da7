"""From a starting point down to the optimum it leads to, on log-parameters within bounds.

References
----------
.. [1] M. A. Branch, T. F. Coleman and Y. Li, A subspace, interior, and conjugate gradient
   method for large-scale bound-constrained minimization problems, SIAM Journal on Scientific
   Computing 21 (1999), 1-23: `scipy.optimize.least_squares`.
.. [2] J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed., Springer, 2006, section
   3.4: Newton's method with the moduli of the curvatures.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.identify.problem import Problem

PRIOR_WIDTH = 100.0
"""Width in e-folds of the prior that every parameter has, about the middle of its range.

Wherever the trace says anything at all it is without effect: it changes an
estimate by the square of (standard deviation / 100 e-folds). A parameter of which
the trace says nothing comes out in the middle of the range left to it, not where
rounding errors leave it, which differs from processor to processor.
"""

ROUGH, FAIR, FINE = 1e-5, 1e-6, 1e-8
"""Stop when a step lowers the cost by less than this share.

To tell basins apart; to know chi^2 of some thousand samples to 0.01; to be there.
All are far above rounding, so that every machine stops at the same step.
"""

_MOST_EVALUATIONS = 300
_MOST_STEPS = 30
# Steps shrink some tenfold each. Whether one is below 1e-9 every machine sees alike, and a few
# more take the rest of it below rounding.
_NEARLY_SETTLED = 1e-9
_LAST_STEPS = 4
# While every step is so much shorter than the last, the curvature need not be found anew.
_SHRUNK = 0.1
# Step of the differences that it is found by.
_STEP = 1e-5


@dataclass(frozen=True)
class LocalFit:
    """An optimum.

    Parameters
    ----------
    log_parameters : (n_parameters,)
        Where it is.
    misfit_rad
        RMS misfit there.
    evaluations
        Responses simulated on the way.
    """

    log_parameters: Array
    misfit_rad: float
    evaluations: int


Rows = Callable[[Array], tuple[Array, Array]]


class Objective:
    """Residuals in units of the noise, perhaps with further rows below them, and with the prior.

    Parameters
    ----------
    problem
        What is fitted.
    further
        Values, and derivatives by the log-parameters, of what else a fit should keep small.
    """

    def __init__(self, problem: Problem, further: Rows | None = None) -> None:
        self._further = further
        self.low, self.high = problem.low, problem.high
        self._residuals = problem.residuals
        self._middle = 0.5 * (problem.low + problem.high)
        self._prior = np.eye(len(self._middle)) / PRIOR_WIDTH
        self._last: tuple[Array, Array, Array, float] | None = None
        self.evaluations = 0

    def both(self, x: Array) -> tuple[Array, Array]:
        """Residual rows and their Jacobian; the last are kept, for both are asked for in turn."""
        if self._last is None or not np.array_equal(self._last[0], x):
            scale = self._residuals.noise_scale_rad
            residual, sensitivity = self._residuals.condensed(x)
            rows, slopes = [residual / scale], [sensitivity.T / scale]
            if self._further is not None:
                values, derivatives = self._further(x)
                rows.append(values)
                slopes.append(derivatives)
            rows.append((x - self._middle) / PRIOR_WIDTH)
            slopes.append(self._prior)
            misfit = float(np.linalg.norm(residual)) / np.sqrt(self._residuals.samples)
            self._last = x.copy(), np.concatenate(rows), np.concatenate(slopes), misfit
            self.evaluations += 1
        return self._last[1], self._last[2]

    def rows(self, x: Array) -> Array:
        """Residual rows."""
        return self.both(x)[0]

    def jacobian(self, x: Array) -> Array:
        """Their Jacobian."""
        return self.both(x)[1]

    def chi2(self, rows: Array) -> float:
        """Sum of squares of rows, in units of the noise, without what is the prior's."""
        told = rows[: -len(self._middle)]
        return float(told @ told)

    def misfit_rad(self, x: Array) -> float:
        """RMS misfit."""
        self.both(x)
        assert self._last is not None
        return self._last[3]


def on_all_samples(problem: Problem, x: Array) -> tuple[Array, float]:
    """Return gradient and misfit to all digits: few rows stand for all samples but for some.

    Parameters
    ----------
    problem
        What is fitted.
    x : (n_parameters,)
        Log-parameters.

    Returns
    -------
    gradient : (n_parameters,)
        Of half the sum of squares of an `Objective`.
    misfit_rad
        RMS misfit.
    """
    gradient, misfit_rad = problem.residuals.gradient(x)
    away = x - 0.5 * (problem.low + problem.high)
    scale = problem.residuals.noise_scale_rad
    return gradient / scale**2 + away / PRIOR_WIDTH**2, misfit_rad


def local_fit(problem: Problem, start: Array, tolerance: float = FINE) -> LocalFit:
    """Fit from one starting point with SciPy's bounded trust-region least squares.

    Parameters
    ----------
    problem
        What is fitted.
    start : (n_parameters,)
        Log-parameters; moved into the bounds if need be.
    tolerance
        `ROUGH`, `FAIR` or `FINE`.
    """
    from scipy.optimize import least_squares

    objective = Objective(problem)
    inside = 1e-9 * (problem.high - problem.low)
    found = least_squares(
        objective.rows,
        np.clip(start, problem.low + inside, problem.high - inside),
        objective.jacobian,
        (problem.low, problem.high),
        ftol=tolerance,
        xtol=FINE,
        gtol=FINE,
        max_nfev=_MOST_EVALUATIONS,
    )
    return LocalFit(found.x, objective.misfit_rad(found.x), objective.evaluations)


def settled(problem: Problem, found: LocalFit) -> LocalFit:
    """Take Newton steps until an optimum stands still to the last digits.

    A trust region compares sums of squares, and so finds an optimum to half the
    digits; where the gradient vanishes can be found to all of them, from all the
    samples. Parameters that push against a bound stay on it, and branches are named
    in the order in which they relax. The curvature is the full one: along a valley,
    where parameters trade against each other, that of Gauss and Newton leaves out
    most of it, and its steps go to and fro for ever.
    """
    nearby = Objective(problem)
    x, left, evaluations = found.log_parameters, _MOST_STEPS, 0
    length = before = np.inf
    while left > 0:
        downhill = -on_all_samples(problem, x)[0]
        evaluations += 1
        if not length < _SHRUNK * before:
            curvature = _curvature(nearby, x)
        edge = 1e-6 * (problem.high - problem.low)
        stuck = ((x <= problem.low + edge) & (downhill < 0)) | (
            (x >= problem.high - edge) & (downhill > 0)
        )
        x = np.where(stuck & (downhill < 0), problem.low, x)
        x = np.where(stuck & (downhill > 0), problem.high, x)
        step = np.zeros_like(x)
        # What rounding does to a step, the next one mends.
        step[~stuck] = _newton(curvature[np.ix_(~stuck, ~stuck)], downhill[~stuck])
        before, length = length, float(np.max(np.abs(step)))
        x = np.clip(x + step / max(length, 1.0), problem.low, problem.high)
        left = _LAST_STEPS if left > _LAST_STEPS and length < _NEARLY_SETTLED else left - 1
    _, misfit = on_all_samples(problem, x)
    evaluations += 1 + nearby.evaluations
    if not misfit <= found.misfit_rad * (1 + FINE):
        x, misfit = found.log_parameters, found.misfit_rad
    order = problem.residuals.model.in_order(np.exp(x)[None])[0]
    return LocalFit(x[order], misfit, evaluations)


def _newton(curvature: Array, downhill: Array) -> Array:
    """Step to where a quadratic form is flat, or, if it curves down, mirrored to go downhill."""
    bend, turned = np.linalg.eigh(curvature)
    step: Array = turned @ ((turned.T @ downhill) / np.maximum(np.abs(bend), PRIOR_WIDTH**-2))
    return step


def _curvature(objective: Objective, x: Array) -> Array:
    """Second derivatives of half the sum of squares.

    What Gauss and Newton leave out are residuals times their second derivatives.
    Only these are differenced, so that where the residuals vanish, rounding does too.
    """
    rows, jacobian = objective.both(x)
    bend = [(objective.jacobian(x + step) - jacobian).T @ rows for step in _STEP * np.eye(len(x))]
    return jacobian.T @ jacobian + 0.5 * (np.array(bend) + np.array(bend).T) / _STEP
