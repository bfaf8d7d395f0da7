"""Fits by SciPy, of all samples and one at a time: independent of how the study fits."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.fit.problem import Problem


@dataclass(frozen=True)
class ScipyFit:
    """An optimum: where it is, (n_parameters,), and the RMS misfit there."""

    log_parameters: Array
    misfit_rad: float


def scipy_fit(problem: Problem, start: Array) -> ScipyFit:
    """Fit all samples from log-parameters with SciPy's bounded trust-region least squares."""
    noise_rad, width = problem.residuals.noise_scale_rad, problem.high - problem.low
    found = least_squares(
        lambda x: problem.residuals(x)[0] / noise_rad,
        np.clip(start, problem.low + 1e-9 * width, problem.high - 1e-9 * width),
        lambda x: problem.residuals(x)[1].T / noise_rad,
        (problem.low, problem.high),
        max_nfev=300,
    )
    return ScipyFit(found.x, noise_rad * float(np.sqrt(np.mean(found.fun**2))))
