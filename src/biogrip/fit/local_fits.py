"""Local fits of log-parameters within bounds, computed many at once.

The fits of traces with the same protocol, sampling times and model, from any number of starts,
are computed as one array. The result of a fit does not depend, to the last bit, on the other
fits.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, IntArray, parts
from biogrip.fit.levenberg_marquardt import Constraint, Minima, Normal, minimize
from biogrip.fit.problem import TraceProblem

PRIOR_WIDTH = 100.0
"""Standard deviation, in e-folds, of the Gaussian prior about the middle of each range.

The prior changes an estimate only by the square of (standard deviation / 100 e-folds).
A parameter that the trace does not inform ends in the middle of the range left to it.
Without the prior, rounding errors would place it, and these differ between processors.
"""

ROUGH, FAIR, FINE = 1e-5, 1e-6, 1e-8
"""Relative decrease of the sum of squares below which a fit has converged.

`ROUGH` distinguishes basins, `FAIR` gives chi^2 of some thousand readings to 0.01, `FINE` gives
the optimum. All are far above rounding errors, so that every machine stops at the same step.
"""

# Step of the differences of exact first derivatives that give second derivatives of residuals.
_APART = 1e-4
# Most numbers in the rows that are formed at once.
_AT_ONCE = 1_000_000


def alike(problems: Sequence[TraceProblem]) -> list[IntArray]:
    """Group the indices of problems that one `LocalFits` can fit together."""
    groups: list[list[int]] = []
    for index, problem in enumerate(problems):
        for group in groups:
            if problem.residuals.shares_responses(problems[group[0]].residuals):
                group.append(index)
                break
        else:
            groups.append([index])
    return [np.array(group) for group in groups]


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
        self._traces = np.stack([problem.residuals.condensed_trace for problem in problems])
        # Not the noise that is stated: the optimum must not depend on what is believed of it.
        self._noise_sd = np.array([problem.residuals.scatter for problem in problems])
        self._middle = 0.5 * (self.low + self.high)

    def normal(self, x: Array, trace: IntArray) -> Normal:
        """Return the normal equations of the residuals, in units of the noise, and the prior.

        They are at log-parameters, (n, n_parameters), each compared with a trace by index, (n,).
        """
        size = max(1, _AT_ONCE // (self._traces.shape[1] * (1 + x.shape[1])))
        normals = []
        for some in parts(max(len(x), 1), size):
            rows = self._residuals.condensed_responses(x[some])
            normals.append(self._normal_of(rows, x[some], trace[some]))
        return Normal.joined(normals) if len(normals) > 1 else normals[0]

    def curved(self, x: Array, trace: IntArray) -> Normal:
        """Return normal equations with the full Hessian in place of its Gauss-Newton part.

        The Gauss-Newton part lacks residuals times their second derivatives. Only these
        derivatives are finite differences, so that their error vanishes with the residuals.
        """
        normals = []
        numbers = 2 * x.shape[1] * (1 + x.shape[1]) * self._traces.shape[1]
        for some in parts(len(x), max(1, _AT_ONCE // numbers)):
            here, own = x[some], trace[some]
            rows = self._residuals.condensed_responses(here)
            normals.append(self._normal_of(rows, here, own))
            normals[-1].information += self._second(rows[:, 0], here, own)
        return Normal.joined(normals)

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

        return minimize(objective, starts, low, high, tolerance, constraint)
