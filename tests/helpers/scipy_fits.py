"""Fits by SciPy, of all samples and one at a time: independent of how the study fits."""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.fit.local_fits import PRIOR_WIDTH
from biogrip.fit.problem import Problem

_MOST_EVALUATIONS = 300


@dataclass(frozen=True)
class ScipyFit:
    """An optimum: where it is, (n_parameters,), and the RMS misfit there."""

    log_parameters: Array
    misfit_rad: float


def scipy_fit(
    problem: Problem, start: Array, tolerance: float = 1e-8, *, prior: bool = False
) -> ScipyFit:
    """Fit all samples from one starting point with SciPy's bounded trust-region least squares.

    Parameters
    ----------
    problem
        What is fitted.
    start : (n_parameters,)
        Log-parameters; moved into the bounds if need be.
    tolerance
        Stop when a step lowers the sum of squares by less than this share.
    prior
        Whether beside the samples there is the study's prior, without which a parameter
        that the trace says nothing of has no optimum.
    """
    noise_rad, width = problem.residuals.noise_scale_rad, problem.high - problem.low
    count = len(width)
    weight = 1 / PRIOR_WIDTH if prior else 0.0

    @functools.lru_cache(maxsize=1)
    def both(x: tuple[float, ...]) -> tuple[Array, Array]:
        """Residuals and slopes, which are asked for in turn."""
        residual, slopes = problem.residuals(np.array(x))
        away = weight * (x - problem.low - 0.5 * width)
        return (
            np.append(residual / noise_rad, away),
            np.vstack((slopes.T / noise_rad, weight * np.eye(count))),
        )

    found = least_squares(
        lambda x: both(tuple(x))[0],
        np.clip(start, problem.low + 1e-9 * width, problem.high - 1e-9 * width),
        lambda x: both(tuple(x))[1],
        (problem.low, problem.high),
        ftol=tolerance,
        xtol=min(tolerance, 1e-8),
        gtol=min(tolerance, 1e-8),
        max_nfev=_MOST_EVALUATIONS,
    )
    samples = noise_rad * found.fun[:-count]
    return ScipyFit(found.x, float(np.linalg.norm(samples)) / np.sqrt(len(samples)))
