"""Local fits of many traces at once: same protocol, sampling times and model.

`biogrip.identify.local_fit` for any number of traces and starting points as one
array. To the last bit, a fit does not depend on which others are made with it.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from biogrip.arrays import Array, IntArray, parts
from biogrip.identify.levenberg_marquardt import (
    Constraint,
    Minima,
    Normal,
    minimized,
)
from biogrip.identify.local_fit import FINE, PRIOR_WIDTH
from biogrip.identify.problem import Problem
from biogrip.identify.refreshed_fits import minimized_with_refreshes

# Numbers in the rows that are formed at once, where every sample has one.
_AT_ONCE = 2_000_000


class Held(Constraint, Protocol):
    """What fits are held to: a relation between parameters, and perhaps residuals of its own."""

    def started(self, x: Array) -> Array:
        """Points near the given ones, one a fit, at which the relation holds."""

    def added(self, normal: Normal, x: Array, fit: IntArray) -> Normal:
        """Normal equations with its own residuals in them."""


def fit_together(problems: Sequence[Problem]) -> bool:
    """Whether `ManyFits` can serve problems: few rows stand for all samples, the same for all."""
    first = problems[0]
    return all(
        problem.residuals.condensable
        and problem.residuals.shares_responses(first.residuals)
        and np.array_equal(problem.low, first.low)
        and np.array_equal(problem.high, first.high)
        for problem in problems
    )


class ManyFits:
    """Fits to any of a number of traces.

    Parameters
    ----------
    problems
        One a trace, with which `fit_together` has to agree.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = problems
        self.low, self.high = problems[0].low, problems[0].high
        self._residuals = problems[0].residuals
        self._traces = np.stack([problem.residuals.condensed_trace for problem in problems])
        self._noise_rad = np.array([problem.residuals.noise_scale_rad for problem in problems])
        self._middle = 0.5 * (self.low + self.high)

    def normal(self, x: Array, trace: IntArray) -> Normal:
        """Normal equations of the `Objective` of each fit.

        Parameters
        ----------
        x : (n, n_parameters)
            Log-parameters.
        trace : (n,)
            Which trace each is compared with.
        """
        return self._in_parts(self._residuals.condensed_responses, x, trace)

    def _in_parts(
        self, rows_of: Callable[..., Array], x: Array, trace: IntArray, *beside: Array
    ) -> Normal:
        """Normal equations, with rows of so many fits at once as memory has room for."""
        size = max(1, _AT_ONCE // (self._traces.shape[1] * (1 + x.shape[1])))
        if len(x) <= size:
            return self._normal_of(rows_of(x, *beside), x, trace)
        normals = [
            self._normal_of(rows_of(x[some], *(row[some] for row in beside)), x[some], trace[some])
            for some in parts(len(x), size)
        ]
        found = zip(*(normal.parts for normal in normals), strict=True)
        return Normal(*(np.concatenate(part) for part in found))

    def _normal_of(self, rows: Array, x: Array, trace: IntArray) -> Normal:
        """Normal equations, given rows of the responses; infinitely bad where these are none."""
        answered = np.isfinite(rows[:, 0, 0])
        if not np.all(answered):
            rows[~answered] = 0.0
        rows[:, 0] -= self._traces[trace]
        products = rows @ rows.swapaxes(1, 2)
        misfit_rad = np.sqrt(products[:, 0, 0] / self._residuals.samples)
        products /= (self._noise_rad[trace] ** 2)[:, None, None]
        away = (x - self._middle) / PRIOR_WIDTH
        diagonal = np.arange(1, 1 + x.shape[1])
        products[:, diagonal, diagonal] += 1 / PRIOR_WIDTH**2
        square_sum = products[:, 0, 0] + np.sum(away**2, axis=1)
        return Normal(
            np.where(answered, square_sum, np.inf),
            products[:, 0, 1:] + away / PRIOR_WIDTH,
            products[:, 1:, 1:],
            np.where(answered, misfit_rad, np.inf),
        )

    def fitted(
        self,
        starts: Array,
        trace: IntArray,
        tolerance: float = FINE,
        *,
        held: Held | None = None,
        low: Array | None = None,
        high: Array | None = None,
    ) -> Minima:
        """Fit from starting points.

        Parameters
        ----------
        starts : (n, n_parameters)
            Log-parameters; moved into the bounds if need be, and to where fits are held.
        trace : (n,)
            Which trace each is fitted to.
        tolerance
            `ROUGH`, `FAIR` or `FINE`.
        held
            What the fits are held to.
        low, high : (n, n_parameters) or (n_parameters,)
            Bounds instead of the search range; a parameter between equal ones is known.
        """
        low = np.broadcast_to(self.low if low is None else low, starts.shape)
        high = np.broadcast_to(self.high if high is None else high, starts.shape)
        starts = np.clip(starts, low, high)
        if held is not None:
            starts = held.started(starts)

        def rows_of(x: Array, correction: Array | None = None) -> Array:
            rows = self._residuals.condensed_linear(x)
            if correction is not None:
                rows += correction
            return rows

        def objective(x: Array, fit: IntArray, correction: Array | None = None) -> Normal:
            beside = () if correction is None else (correction,)
            normal = self._in_parts(rows_of, x, trace[fit], *beside)
            return normal if held is None else held.added(normal, x, fit)

        if self._residuals.nonlinear:
            correction = self._residuals.condensed_corrections
            return minimized_with_refreshes(
                objective, correction, starts, low, high, tolerance, held
            )
        return minimized(objective, starts, low, high, tolerance, held)
